# SPDX-License-Identifier: Apache-2.0
"""`./kerf identify`: mass, friction, delay, quantum and mode of a device, from a recording of its motion, or from a motion that it
makes itself (docs/gains.md).

    python3 identify FOLDER_OF_KERF FOLDER_OF_PROGRAMS --log DIR [--out FILE]
    python3 identify FOLDER_OF_KERF FOLDER_OF_PROGRAMS --scene SCENE [--device NAME] [--port PORT] [--log DIR] [--out FILE]

Exit codes: 0 fine; 1 the log does not have them, or the motion ended early; 2 bad input or set-up; 130 interrupted."""
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
    for option in ("--log", "--scene", "--device", "--port"):
        parser.add_argument(option)
    parser.add_argument("--out", default="device.toml")
    options = parser.parse_args(words)
    if not options.out.endswith(".toml"):
        raise Refusal(f"--out {options.out}: is no .toml; name it so, for kerf lab zwidth --device")
    if options.scene:
        options.log = options.log or options.out.removesuffix(".toml") + ".log"
        return options
    if not options.log:
        raise Refusal("no --scene and no --log: give a scene to move its device, such as external, or the folder of a recording")
    for option in ("device", "port"):
        if getattr(options, option):
            raise Refusal(f"--{option}: is of a device that moves; give --scene too, or leave it out")
    return options


def _find_scene(root, name):
    """The file of that name; else that of kerf's own scenes, with or without the ending."""
    shipped = os.path.join(root, "scenes", name)
    return next((path for path in (name, shipped, shipped + ".toml") if os.path.isfile(path)), name)


def _need(root, moves):
    """NumPy, the reader of logs, and for a motion `import kerf`: of the clone, if it was built there."""
    sys.path.append(os.path.join(root, "python"))
    try:
        import numpy  # noqa: F401
        import kerf_reader  # noqa: F401
    except ImportError as error:
        raise Refusal(f"python3: no {error.name}; install the package python3-{'numpy' if error.name == 'numpy' else 'kerf'}") from None
    if not moves:
        return
    # The sources' own folder `kerf` has no module in it.
    sys.path[:] = [os.path.join(root, "build", "python", "python"), *(path for path in sys.path if path != os.path.join(root, "python"))]
    try:
        import kerf  # noqa: F401
    except ImportError:
        build = "in a clone: cmake --preset python && cmake --build --preset python --target kerf_python"
        raise Refusal(f"python3: no module kerf, by which the device is moved; install python3-kerf, or {build} (docs/python.md)") from None


def run(root, binaries, words):
    options = _options(words)
    _need(root, bool(options.scene))
    import device_file
    import estimate
    import log_motion
    if options.scene:
        import guided
        options.scene = _find_scene(root, options.scene)
        if os.path.lexists(options.log):
            raise Refusal(f"--log {options.log}: exists already; name a new folder, or identify from it: leave --scene out")
        try:
            guided.record(binaries, options)
        except guided.Refused as error:
            raise Refusal(str(error)) from None
        except guided.Stopped as error:
            kept = f"; what was recorded is in {options.log}: kerf identify --log {options.log}" if os.path.isdir(options.log) else ""
            raise estimate.NoEstimate(f"{error}{kept}") from None
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
    print(f"written to {options.out}; for a map: kerf lab zwidth --device {options.out}")


def main():
    try:
        run(sys.argv[1], sys.argv[2], sys.argv[3:])
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
