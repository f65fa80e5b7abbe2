# SPDX-License-Identifier: Apache-2.0
"""`./kerf identify`: mass, friction, delay, quantum and mode of a device, from a recording of its motion (docs/identify.md).

    python3 identify FOLDER_OF_KERF --log DIR [--out FILE]

Exit codes: 0 fine; 1 the log does not have them; 2 bad input or set-up; 130 interrupted."""
import argparse
import os
import sys
import tempfile


class Refusal(Exception):
    """One line: place, value, way out."""


class _Words(argparse.ArgumentParser):
    def error(self, message):
        raise Refusal(f"{message}; see ./kerf identify --help")


def _write(path, text):
    """The whole file or none."""
    folder = os.path.dirname(path) or "."
    try:
        with tempfile.NamedTemporaryFile("w", dir=folder, prefix=".device-", suffix=".toml", delete=False) as file:
            file.write(text)
        os.chmod(file.name, 0o666 & ~_umask())
        os.replace(file.name, path)
    except OSError as error:
        raise Refusal(f"--out {path}: {error.strerror}; name a file in a folder that can be written") from None


def _umask():
    now = os.umask(0)
    os.umask(now)
    return now


def _options(words):
    parser = _Words(prog="kerf identify", add_help=False, allow_abbrev=False)
    parser.add_argument("--log")
    parser.add_argument("--out", default="device.toml")
    options = parser.parse_args(words)
    if not options.log:
        raise Refusal("no --log: give the folder of a recording; docs/identify.md says how to make one")
    if not options.out.endswith(".toml"):
        raise Refusal(f"--out {options.out}: is no .toml; name it so, for kerf lab zwidth --device")
    return options


def run(root, words):
    options = _options(words)
    sys.path.append(os.path.join(root, "python"))
    try:
        import numpy  # noqa: F401
        import kerf_reader  # noqa: F401
    except ImportError as error:
        raise Refusal(f"python3: no {error.name}; install the package python3-{'numpy' if error.name == 'numpy' else 'kerf'}") from None
    import device_file
    import estimate
    import log_motion
    try:
        motion, lines = log_motion.read(options.log)
    except (ValueError, KeyError, OSError) as error:
        raise Refusal(f"--log {options.log}: {error}") from None
    for line in lines:
        print(f"kerf: identify: {line}")
    found = estimate.estimate(motion)
    for line in device_file.report(found, motion.period_s):
        print(line)
    _write(options.out, device_file.text_of(found, motion.period_s, options.log))
    print(f"kept in {options.out}; a map of it: kerf lab zwidth --device {options.out}")


def main():
    try:
        run(sys.argv[1], sys.argv[2:])
        code = 0
    except KeyboardInterrupt:
        code = 130
    except Exception as error:
        kind = type(error).__name__
        if kind not in ("Refusal", "NoEstimate"):
            raise
        print("kerf: identify: " + " ".join(str(error).split()), file=sys.stderr)
        code = 2 if kind == "Refusal" else 1
    sys.exit(code)


if __name__ == "__main__":
    main()
