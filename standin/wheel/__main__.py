# SPDX-License-Identifier: Apache-2.0
from kerf_standin import exit_with_main

exit_with_main()
