# SPDX-License-Identifier: Apache-2.0
# The servo core as WebAssembly with WASI, by Debian's clang, wasi-libc and libc++: only with
# -DKERF_CORE_ONLY=ON. An exception ends the program there (exceptions are no part of this libc++).
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
include(${CMAKE_CURRENT_LIST_DIR}/clang.cmake)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
add_compile_options(--sysroot=/ -nostdinc++ -fignore-exceptions
  "SHELL:-isystem /usr/lib/llvm-${KERF_CLANG_VERSION}/include/wasm32-wasi/c++/v1" "SHELL:-isystem /usr/include/wasm32-wasi")
# What doctest asks of a system and this one lacks: signals, exceptions.
add_compile_definitions(_WASI_EMULATED_SIGNAL DOCTEST_CONFIG_NO_POSIX_SIGNALS
  DOCTEST_CONFIG_NO_EXCEPTIONS_BUT_WITH_ALL_ASSERTS)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-L/usr/lib/llvm-${KERF_CLANG_VERSION}/lib/wasm32-wasi -L/usr/lib/wasm32-wasi -Wl,-z,stack-size=8388608 -lwasi-emulated-signal")
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_EXECUTABLE_SUFFIX .wasm)
