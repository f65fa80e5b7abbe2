#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether kerf reads the test files of Debian's python3-pydicom, python3-nibabel and invesalius-examples as their own
readers do: other_readers.py VOLUME_DUMP. Each file is refused in one line, or each voxel has their value and position.
A package that is not installed is skipped, with a line. Exit code 1 if a file is read otherwise."""
import pathlib
import plistlib
import subprocess
import sys
import tarfile

import numpy as np

PACKAGES = pathlib.Path("/usr/lib/python3/dist-packages")


def dumped(program, path):
    """The values (x, y, z) and the affine in LPS as kerf reads them, or the line of the refusal."""
    run = subprocess.run([program, path], capture_output=True, check=False)
    if run.returncode == 2:
        return run.stderr.decode(errors="replace").strip()
    head, voxels = run.stdout.split(b"\n", 1)
    numbers = [float(word) for word in head.split()]
    affine = np.eye(4)
    affine[:3, :3] = np.reshape(numbers[9:], (3, 3)) * numbers[3:6]
    affine[:3, 3] = numbers[6:9]
    return np.frombuffer(voxels).reshape([int(n) for n in numbers[:3]], order="F"), affine


def nifti(path):
    import nibabel
    image = nibabel.load(path)
    values = np.asarray(image.dataobj, dtype=np.float64)
    return values.reshape(values.shape[:3]), np.diag([-1, -1, 1, 1]) @ image.affine


def plane(dataset):
    """Affine of one slice: columns of x, y and the origin; z is set by the caller."""
    way = np.array(dataset.ImageOrientationPatient, dtype=float)
    rows_mm, columns_mm = (float(x) for x in dataset.PixelSpacing)
    affine = np.eye(4)
    affine[:3, 0], affine[:3, 1] = way[:3] * columns_mm, way[3:] * rows_mm
    affine[:3, 2] = np.cross(way[:3], way[3:])
    affine[:3, 3] = dataset.ImagePositionPatient
    return affine


def scaled(pixels, dataset):
    return pixels * float(dataset.get("RescaleSlope", 1)) + float(dataset.get("RescaleIntercept", 0))


def dicom(path):
    import pydicom
    if path.is_dir():
        slices = [pydicom.dcmread(file) for file in path.iterdir()]
        slices = [one for one in slices if "PixelData" in one and one.SeriesInstanceUID == slices[0].SeriesInstanceUID]
    else:
        whole = pydicom.dcmread(path)
        if "GridFrameOffsetVector" in whole:  # a dose
            affine = plane(whole)
            affine[:3, 2] *= whole.GridFrameOffsetVector[1] - whole.GridFrameOffsetVector[0]
            return whole.pixel_array.transpose(2, 1, 0) * float(whole.get("DoseGridScaling", 1)), affine
        slices = []
        for number, group in enumerate(whole.PerFrameFunctionalGroupsSequence):
            shared = whole.SharedFunctionalGroupsSequence[0]
            one = pydicom.Dataset()
            for name in ("PlanePositionSequence", "PlaneOrientationSequence", "PixelMeasuresSequence",
                         "PixelValueTransformationSequence"):
                for element in (group.get(name) or shared.get(name) or [pydicom.Dataset()])[0]:
                    one.add(element)
            one.pixels = whole.pixel_array[number]
            slices.append(one)
    affine = plane(slices[0])
    depth = [np.dot(affine[:3, 2], np.array(one.ImagePositionPatient, dtype=float)) for one in slices]
    order = np.argsort(depth)
    affine[:3, 3] = slices[order[0]].ImagePositionPatient
    affine[:3, 2] *= (max(depth) - min(depth)) / (len(depth) - 1)
    pixels = [scaled(getattr(slices[n], "pixels", None) if hasattr(slices[n], "pixels") else slices[n].pixel_array,
                     slices[n]) for n in order]
    return np.stack(pixels).transpose(2, 1, 0), affine


def invesalius(path):
    with tarfile.open(path) as tar:
        members = {pathlib.PurePath(m.name).name: m for m in tar.getmembers()}
        project = plistlib.loads(tar.extractfile(members["main.plist"]).read())
        matrix = project["matrix"]
        raw = tar.extractfile(members[matrix["filename"]]).read()
    values = np.frombuffer(raw, dtype=matrix["dtype"]).reshape(matrix["shape"])
    return values.transpose(2, 1, 0).astype(float), np.diag([*project["spacing"], 1.0])


def difference(ours, theirs, with_position):
    """The first difference as text; empty if there is none."""
    (values, affine), (wanted, place) = ours, theirs
    if not with_position:  # the format has no position: kerf may mirror axes alone
        return "" if sorted(values.shape) == sorted(wanted.shape) and np.array_equal(
            np.sort(values, axis=None), np.sort(wanted, axis=None)) else "other values"
    if values.size != wanted.size:
        return f"{values.shape} voxels for {wanted.shape}"
    index = np.indices(wanted.shape).reshape(3, -1)
    at = np.linalg.inv(affine) @ place @ np.vstack([index, np.ones(index.shape[1])])
    nearest = np.rint(at[:3]).astype(int)
    if np.abs(at[:3] - nearest).max() > 0.01 or (nearest.T < 0).any() or (nearest.T >= values.shape).any():
        return "other positions"
    apart = np.abs(values[tuple(nearest)] - wanted[tuple(index)]).max()
    return "" if apart <= 1e-6 * max(1, np.abs(wanted).max()) else f"values apart by {apart}"


def main(program):
    pydicom, nibabel = PACKAGES / "pydicom/data/test_files", PACKAGES / "nibabel/tests/data"
    skull = pathlib.Path("/usr/share/doc/invesalius-examples/examples")
    folders = {file.parent for file in pydicom.glob("dicomdirtests/**/*") if file.is_file()}
    jobs = [("python3-pydicom", dicom, [*sorted(pydicom.glob("*.dcm")), *sorted(folders)]),
            ("python3-nibabel", nifti, [*sorted(nibabel.glob("*.nii")), *sorted(nibabel.glob("*.nii.gz"))]),
            ("invesalius-examples", invesalius, sorted(skull.glob("*.inv3")))]
    wrong = 0
    for package, reader, paths in jobs:
        if not paths:
            print(f"skipped: {package} is not installed")
        for path in paths:
            ours = dumped(program, path)
            if isinstance(ours, str):
                print(f"refused: {ours}")
                wrong += "\n" in ours or not ours
                continue
            found = difference(ours, reader(path), reader is not invesalius)
            wrong += found != ""
            print(f"{'WRONG' if found else 'same'}: {path}{': ' if found else ''}{found}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
