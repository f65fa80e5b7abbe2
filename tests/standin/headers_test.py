# SPDX-License-Identifier: Apache-2.0
"""Programs that are compiled with the headers of the stand-in, as a stranger would: with no other include folder, in each dialect,
and linked with -lHDU -lHD.

    headers_test.py ROOT PROGRAMS LIBRARIES"""
import os
import subprocess
import unittest

from stand_in_case import HERE, LIBRARIES, ROOT, Case

HEADERS = ROOT / "standin" / "include"
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]
IN_C = """
#include <HDU/hduVector.h>
#include <HDU/hduError.h>
#include <HD/hd.h>
HDCallbackCode HDCALLBACK tick(void* data) {
  hduVector3Dd position, force;
  HDErrorInfo error;
  (void)data;
  hdBeginFrame(hdGetCurrentDevice());
  hdGetDoublev(HD_CURRENT_POSITION, position);
  hduVecScale(force, position, -0.1);
  if (hduVecMagnitude(force) > 1) hduVecNormalizeInPlace(force);
  hdSetDoublev(HD_CURRENT_FORCE, force);
  hdEndFrame(hdGetCurrentDevice());
  if (HD_DEVICE_ERROR(error = hdGetError())) hduPrintError(stderr, &error, "tick");
  return hduIsSchedulerError(&error) ? HD_CALLBACK_DONE : HD_CALLBACK_CONTINUE;
}
int main(void) {
  return hdScheduleAsynchronous(tick, 0, HD_DEFAULT_SCHEDULER_PRIORITY) != 0;
}
"""
IN_CPP = """
#include <HDU/hduQuaternion.h>
#include <HDU/hduError.h>
#include <iostream>
int main() {
  const hduVector3Dd a(1, 2, 3);
  hduVector3Df b(a * 0.5f);
  hduMatrix m = hduMatrix::createRotation(a, 1) * hduMatrix::createTranslation(a);
  hduQuaternion q(m);
  HDErrorInfo error = hdGetError();
  std::cout << a << b << m << q << error << (2 * a - a / 3)[0] << a * m;
  return m.invert() ? 0 : 1;
}
"""


class Headers(Case):
    def compile(self, *words, text=""):
        compiler = os.environ.get("CXX", "c++").split()
        return subprocess.run([*compiler, f"-I{HEADERS}", *words], input=text, capture_output=True, text=True, check=False)

    def test_they_compile_alone_in_every_dialect_without_a_warning(self):
        for language, text, dialects in (("c", IN_C, ("c99", "gnu11")),
                                         ("c++", IN_C, ("c++98", "c++20")),
                                         ("c++", IN_CPP, ("c++98", "c++11", "gnu++11", "c++17", "c++20"))):
            for dialect in dialects:
                with self.subTest(language=language, dialect=dialect):
                    done = self.compile("-x", language, f"-std={dialect}", *WARNINGS, "-fsyntax-only", "-", text=text)
                    self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_a_program_in_the_manner_of_the_ros_nodes_runs(self):
        program = self.folder / "client"
        done = self.compile("-std=c++11", *WARNINGS, str(HERE / "hdu_client.cpp"), "-o", str(program), f"-L{LIBRARIES}", "-lHDU", "-lHD")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        code, report, said = self.run_command(str(program), "2000")
        self.assertEqual((report["exit_code"], code, self.misuse(report)), (0, 1, ["bad_handles"]), said)
        self.assertEqual(report["force"]["commands"], 2000)
        self.assertGreater(report["force"]["given_peak_n"], 0.5)


unittest.main(verbosity=1, argv=["headers_test.py"])
