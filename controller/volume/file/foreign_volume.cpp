// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/foreign_volume.hpp"

#include "controller/volume/file/foreign_io.hpp"
// ITK from here on.
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkTIFFImageIO.h>

#ifdef KERF_SANITIZED
// NrrdIO and MetaIO forget memory where they refuse a file; that is their own to mend.
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:libITKNrrdIO\nleak:libITKMetaIO\n";
}
#endif

namespace kerf::volume {

void read_foreign_volume(const std::filesystem::path& path, VolumeKind kind,
                         const std::vector<std::filesystem::path>& folder,
                         const std::string& series, SandboxReader& sandbox) {
  itk::Object::GlobalWarningDisplayOff();  // what it warns of is refused or fine
  const Offer offer = [&](const VolumeClaim& claim) {
    return sandbox.offer(std::as_bytes(std::span(&claim, 1)));
  };
  switch (kind) {
    case VolumeKind::nrrd:
      return read_one_file(path, *itk::NrrdImageIO::New(), read_nrrd_header(path), offer);
    case VolumeKind::meta:
      return read_one_file(path, *itk::MetaImageIO::New(), read_meta_header(path), offer);
    case VolumeKind::nifti:
      return read_one_file(path, *itk::NiftiImageIO::New(), read_nifti_header(path), offer);
    case VolumeKind::tiff:
      return read_one_file(path, *itk::TIFFImageIO::New(), read_tiff_header(path), offer);
    case VolumeKind::dicom_file:
      return read_dicom_file(path, offer);
    case VolumeKind::dicom_series:
      return read_dicom_series(path, folder, series, sandbox, offer);
    case VolumeKind::png_stack:
    case VolumeKind::tiff_stack:
      return read_slice_stack(path, folder, kind, sandbox, offer);
    case VolumeKind::raw:
      break;  // needs its layout: read_raw
  }
}

}  // namespace kerf::volume
