/* SPDX-License-Identifier: Apache-2.0 */
/* Errors of HD for people. Link with -lHDU -lHD. */
#ifndef KERF_STAND_IN_HDU_ERROR_H
#define KERF_STAND_IN_HDU_ERROR_H

#include <HD/hd.h>
#include <stdio.h>

#ifdef __cplusplus
#include <iosfwd>

extern "C" {
#endif

/* Writes one line: `message`, which may be null, the error's text and its numbers. */
void hduPrintError(FILE* stream, const HDErrorInfo* error, const char* message);
/* Whether a force, its step, the speed or warm motors are the cause: the program may go on. */
HDboolean hduIsForceError(const HDErrorInfo* error);
/* Whether the servo or the connection is gone: 302 to 304, 500, 501. The program's callbacks end.
 */
HDboolean hduIsSchedulerError(const HDErrorInfo* error);

#ifdef __cplusplus
}

std::ostream& operator<<(std::ostream& stream, const HDErrorInfo& error);
#endif
#endif
