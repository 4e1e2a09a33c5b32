#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "levelset/start/polygon.h"

namespace scarp {

/// What a cell of a GDSII file draws or refers to.
///
/// Units: database units, degrees.
struct GdsElement {
  enum class Kind { boundary, box, path, cell_reference, array_reference };
  Kind kind = Kind::boundary;
  int layer = 0;
  int datatype = 0;
  double width = 0;  ///< of a path; below 0: not magnified
  int path_type = 0;
  double begin_extension = 0;
  double end_extension = 0;
  std::vector<Point2> points{};
  std::string cell{};  ///< that is referred to
  int columns = 1;
  int rows = 1;
  bool mirrored = false;
  double magnification = 1;
  double angle = 0;

  bool is_reference() const {
    return kind == Kind::cell_reference || kind == Kind::array_reference;
  }
};

/// The cells of a GDSII file.
struct GdsLibrary {
  std::map<std::string, std::vector<GdsElement>> cells;
  double unit = 1;  ///< of the database; nm
};

/// Throws InputError with the name of the file and what is wrong with it.
[[noreturn]] void refuse_layout(const std::filesystem::path& file, const std::string& text);

/// Reads all cells; also of a file that is compressed by gzip.
///
/// Throws: InputError with the name of the file if it is no GDSII file, ends early, is damaged, has
///         two cells of one name, or a database unit that is not above 0.
/// Source: GDSII Stream Format Manual, release 6.0 (Calma, 1987).
GdsLibrary read_gds_library(const std::filesystem::path& file, std::string_view content);

}  // namespace scarp
