// SPDX-License-Identifier: Apache-2.0
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#ifdef KERF_SANITIZED
#define DOCTEST_CONFIG_NO_POSIX_SIGNALS  // the sanitizer tells more of a crash: the line
#endif
#include <doctest/doctest.h>
