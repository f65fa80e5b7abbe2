// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>

namespace kerf {

/// Keeps this process on one core, so that every figure of a run comes from it; negative: on the
/// last that it may use. Returns the core. Throws `HilError`.
int pin_lab(int core);

/// Day, processor, compiler and its flags of a run, for the page that it writes. One line.
[[nodiscard]] std::string lab_provenance();

/// Three digits, or all before the point: how pages show their figures.
[[nodiscard]] std::string page_number(double value);

/// The file of a page's plot: the page's name with `ending`, in the folder plots/ beside the page,
/// which is made. Empty where the page is. Throws `HilError` that names `option`.
[[nodiscard]] std::string page_plot(const char* option, const std::string& page,
                                    const char* ending);

/// `plot` as `page` links to it.
[[nodiscard]] std::string page_link(const std::string& page, const std::string& plot);

/// An output file of a kind that ends in `ending`. Its name is checked before the measurement; the
/// file is made after it. Does nothing for an empty path. Throws `HilError` that names the option,
/// or `FileError`.
class LabOutput {
 public:
  LabOutput(const char* option, std::string path, const char* ending);
  void write(const std::string& text) const;
  /// The same as one part of a page that others write to, too: see `write_page_part`.
  void write_part(const char* name, const std::string& text) const;

  /// Throws `FileError` where two of a run's outputs are one file.
  static void check_distinct(std::initializer_list<const LabOutput*> outputs);

 private:
  const char* option_;
  std::string path_;
};

}  // namespace kerf
