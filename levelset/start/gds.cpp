#include "levelset/start/gds.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/printable.h"
#include "core/recipe/quantity.h"
#include "core/suggestion.h"
#include "levelset/start/gds_library.h"

namespace scarp {

namespace {

/// More shapes than this are taken for a mistake, and so are more references on the way to them.
constexpr std::size_t most_loops = 1'000'000;
constexpr std::size_t most_placements = 20'000'000;

/// Cells within cells; layouts have ten or twenty.
constexpr int most_levels = 200;

/// Database units of layouts lie between these; what lies beyond is refused. Units: nm.
constexpr double least_unit = 1e-3;
constexpr double most_unit = 1e3;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A box around shapes, in the database units of their cell.
struct Extent {
  Point2 lower{infinity, infinity};
  Point2 upper{-infinity, -infinity};

  bool is_empty() const { return !(lower[0] <= upper[0]); }
  void add(const Point2& r) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      lower[axis] = std::min(lower[axis], r[axis]);
      upper[axis] = std::max(upper[axis], r[axis]);
    }
  }
  bool meets(const Extent& other) const {
    return lower[0] <= other.upper[0] && other.lower[0] <= upper[0] && lower[1] <= other.upper[1] &&
           other.lower[1] <= upper[1];
  }
};

/// A linear map and a shift.
struct Placement {
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Identity();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  Point2 operator()(const Point2& r) const {
    const Eigen::Vector2d place = matrix * Eigen::Vector2d(r[0], r[1]) + shift;
    return {place[0], place[1]};
  }
  double scale() const { return std::sqrt(std::abs(matrix.determinant())); }
};

/// First mirrored about the x axis, then magnified, turned and shifted; turns by quarters are
/// exact.
Placement placement_of(const GdsElement& element, const Point2& at) {
  const double quarters = element.angle / 90;
  double cosine = std::cos(element.angle * std::numbers::pi / 180);
  double sine = std::sin(element.angle * std::numbers::pi / 180);
  if (quarters == std::floor(quarters)) {
    cosine = std::round(cosine);
    sine = std::round(sine);
  }
  const double m = element.magnification;
  const double y = element.mirrored ? -m : m;
  Placement placement{.shift = {at[0], at[1]}};
  placement.matrix << m * cosine, -y * sine, m * sine, y * cosine;
  return placement;
}

Placement combined(const Placement& outer, const Placement& inner) {
  return {outer.matrix * inner.matrix, outer.matrix * inner.shift + outer.shift};
}

/// Where one of an array is placed, or a single one.
Point2 at(const GdsElement& element, int column, int row) {
  Point2 place = element.points[0];
  if (element.kind != GdsElement::Kind::array_reference) return place;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double origin = element.points[0][axis];
    place[axis] += column * (element.points[1][axis] - origin) / element.columns +
                   row * (element.points[2][axis] - origin) / element.rows;
  }
  return place;
}

Extent placed_extent(const Extent& inner, const Placement& placement) {
  Extent placed;
  if (!std::isfinite(inner.lower[0])) return inner;
  for (const double x : {inner.lower[0], inner.upper[0]})
    for (const double y : {inner.lower[1], inner.upper[1]}) placed.add(placement({x, y}));
  return placed;
}

Point2 moved(const Point2& r, const Point2& u, double s) {
  return {r[0] + s * u[0], r[1] + s * u[1]};
}

/// The direction from a to b and, by left, the one to its left.
Point2 direction(const Point2& a, const Point2& b) {
  const double x = b[0] - a[0];
  const double y = b[1] - a[1];
  const double norm = std::sqrt(x * x + y * y);
  return {x / norm, y / norm};
}
Point2 left_of(const Point2& u) { return {-u[1], u[0]}; }

/// Mitred up to right angles and somewhat beyond, bevelled where they are sharper.
Loop joint(const Point2& corner, const Point2& u, const Point2& v, double half) {
  const double side = u[0] * v[1] - u[1] * v[0] > 0 ? -1 : 1;
  const Point2 n = left_of(u);
  const Point2 m = left_of(v);
  Loop loop{corner, moved(corner, n, side * half), moved(corner, m, side * half)};
  const double cosine = u[0] * v[0] + u[1] * v[1];
  if (cosine > -0.1) {
    const Point2 sum{n[0] + m[0], n[1] + m[1]};
    loop.insert(loop.begin() + 2, moved(corner, sum, side * half / (1 + cosine)));
  }
  return loop;
}

Loop disc(const Point2& centre, double radius) {
  constexpr int corners = 96;
  Loop loop;
  for (int n = 0; n < corners; ++n) {
    const double phase = 2 * std::numbers::pi * n / corners;
    loop.push_back({centre[0] + radius * std::cos(phase), centre[1] + radius * std::sin(phase)});
  }
  return loop;
}

/// What the ends of a path draw that has no length.
std::vector<Loop> dot_loops(const GdsElement& element, const Point2& centre, double half) {
  if (element.path_type == 1) return {disc(centre, half)};
  const bool custom = element.path_type == 4;
  const double before = element.path_type == 2 ? half : custom ? element.begin_extension : 0;
  const double after = element.path_type == 2 ? half : custom ? element.end_extension : 0;
  if (!(before + after > 0)) return {};
  const auto [x, y] = centre;
  return {{{x - before, y - half},
           {x + after, y - half},
           {x + after, y + half},
           {x - before, y + half}}};
}

/// A rectangle per piece of the path, and what fills the corners between them.
std::vector<Loop> path_loops(const GdsElement& element, double half) {
  std::vector<Point2> line;
  for (const Point2& point : element.points) {
    if (line.empty() || line.back() != point) line.push_back(point);
  }
  std::vector<Loop> loops;
  if (line.empty() || half <= 0) return loops;
  if (line.size() == 1) return dot_loops(element, line[0], half);
  const bool square = element.path_type == 2;
  const bool custom = element.path_type == 4;
  for (std::size_t p = 0; p + 1 < line.size(); ++p) {
    const Point2 u = direction(line[p], line[p + 1]);
    const Point2 n = left_of(u);
    const bool first = p == 0;
    const bool last = p + 2 == line.size();
    const double before = !first ? 0 : square ? half : custom ? element.begin_extension : 0;
    const double after = !last ? 0 : square ? half : custom ? element.end_extension : 0;
    const Point2 a = moved(line[p], u, -before);
    const Point2 b = moved(line[p + 1], u, after);
    loops.push_back({moved(a, n, -half), moved(b, n, -half), moved(b, n, half), moved(a, n, half)});
    if (!last) loops.push_back(joint(line[p + 1], u, direction(line[p + 1], line[p + 2]), half));
  }
  if (element.path_type == 1) {
    loops.push_back(disc(line.front(), half));
    loops.push_back(disc(line.back(), half));
  }
  return loops;
}

/// What a layout draws on the chosen layer.
bool is_chosen(const GdsElement& element, const GdsSelection& selection) {
  return element.layer == selection.layer &&
         (!selection.datatype || element.datatype == *selection.datatype);
}

/// The loops of one shape in its cell; a negative width of a path is not magnified. None where it
/// has no area.
std::vector<Loop> loops_of(const GdsElement& element, double scale) {
  std::vector<Loop> loops{element.points};
  if (element.kind == GdsElement::Kind::path) {
    const double width = element.width < 0 ? -element.width / scale : element.width;
    loops = path_loops(element, 0.5 * width);
  }
  for (Loop& loop : loops) {
    if (!loop.empty() && loop.front() == loop.back()) loop.pop_back();
  }
  std::erase_if(loops, [](const Loop& loop) {
    const auto is_on_line = [&](std::size_t axis) {
      return std::ranges::all_of(loop,
                                 [&](const Point2& point) { return point[axis] == loop[0][axis]; });
    };
    return loop.size() < 3 || is_on_line(0) || is_on_line(1);
  });
  return loops;
}

/// What cells have on the chosen layer and where, found before any of it is written out: references
/// of references can multiply it, or nothing at all, without end.
class Census {
 public:
  Census(const std::filesystem::path& file, const GdsLibrary& library,
         const GdsSelection& selection)
      : file_(file), library_(library), selection_(selection) {}

  /// Around all that a cell and those below it draw.
  const Extent& extent(const std::string& cell) { return count(cell, 1).extent; }

  /// Those of all cells looked at, and of the chosen shapes.
  const std::set<std::pair<int, int>>& layers() const { return layers_; }
  const std::set<int>& datatypes() const { return datatypes_; }

  /// Chosen shapes without area.
  std::size_t flat_count() const { return flat_count_; }

 private:
  struct Count {
    Extent extent{};
    int levels = 0;  ///< of cells, this one included
    bool is_open = true;
  };

  const Count& count(const std::string& cell, int level) {
    const auto found = library_.cells.find(cell);
    if (found == library_.cells.end())
      refuse_layout(file_, "refers to a cell that it lacks: " + repeated(cell) +
                               "; write it with all its cells");
    const auto [place, is_new] = counts_.try_emplace(cell);
    Count& sum = place->second;
    if (!is_new && sum.is_open)
      refuse_layout(file_,
                    "cell " + repeated(cell) + " contains itself; break the circle in the layout");
    if (level + sum.levels > most_levels) {
      refuse_layout(file_, "cell " + repeated(cell) + " is " + std::to_string(most_levels) +
                               " or more references below the one that is read; flatten it");
    }
    if (!is_new) return sum;
    for (const GdsElement& element : found->second) {
      if (element.is_reference()) {
        check_reference(cell, element);
        const Count& inner = count(element.cell, level + 1);
        add_reference(element, inner.extent, sum.extent);
        sum.levels = std::max(sum.levels, inner.levels);
      } else {
        layers_.insert({element.layer, element.datatype});
        if (is_chosen(element, selection_)) add_shape(element, sum.extent);
      }
    }
    ++sum.levels;
    sum.is_open = false;
    return sum;
  }

  void add_shape(const GdsElement& element, Extent& extent) {
    const std::vector<Loop> loops = loops_of(element, 1);
    if (loops.empty()) {
      ++flat_count_;
      return;
    }
    datatypes_.insert(element.datatype);
    for (const Loop& loop : loops)
      for (const Point2& point : loop) extent.add(point);
    // How wide it is there depends on who refers to it.
    if (element.kind == GdsElement::Kind::path && element.width < 0)
      extent = {{-infinity, -infinity}, {infinity, infinity}};
  }

  static void add_reference(const GdsElement& element, const Extent& inner, Extent& extent) {
    if (inner.is_empty()) return;
    for (const int column : {0, element.columns - 1})
      for (const int row : {0, element.rows - 1}) {
        const Extent placed = placed_extent(inner, placement_of(element, at(element, column, row)));
        extent.add(placed.lower);
        extent.add(placed.upper);
      }
  }

  void check_reference(const std::string& cell, const GdsElement& element) const {
    const bool is_array = element.kind == GdsElement::Kind::array_reference;
    if (element.points.size() < (is_array ? 3U : 1U) || element.columns < 1 || element.rows < 1) {
      refuse_layout(file_, "cell " + repeated(cell) + " has a damaged reference to " +
                               repeated(element.cell));
    }
  }

  const std::filesystem::path& file_;
  const GdsLibrary& library_;
  const GdsSelection& selection_;
  std::map<std::string, Count> counts_;
  std::set<std::pair<int, int>> layers_;
  std::set<int> datatypes_;
  std::size_t flat_count_ = 0;
};

/// The columns or rows of an array that may reach into a window.
struct Range {
  int first = 0;
  int last = 0;
};

/// Walks a cell and all that it refers to.
class Flattener {
 public:
  Flattener(const std::filesystem::path& file, const GdsLibrary& library,
            const GdsSelection& selection)
      : file_(file), library_(library), selection_(selection), census_(file, library, selection) {
    if (selection.window) {
      for (const Point2& corner : *selection.window)
        window_.add({corner[0] / library.unit, corner[1] / library.unit});
    } else {
      window_ = {{-infinity, -infinity}, {infinity, infinity}};
    }
  }

  Layout run(const std::string& cell) {
    const Extent extent = census_.extent(cell);
    if (extent.is_empty()) refuse_layer(cell);
    place(cell, {});
    for (std::size_t axis = 0; axis < 2; ++axis) {
      layout_.extent[0][axis] = extent.lower[axis] * library_.unit;
      layout_.extent[1][axis] = extent.upper[axis] * library_.unit;
    }
    add_doubts(cell);
    return std::move(layout_);
  }

 private:
  void place(const std::string& cell, const Placement& placement) {
    if (++placements_ > most_placements)
      refuse_layout(file_,
                    fmt::format("has more than {} references in the domain; choose a smaller "
                                "cell, or flatten the layout",
                                most_placements));
    for (const GdsElement& element : library_.cells.at(cell)) {
      if (!element.is_reference()) {
        if (is_chosen(element, selection_)) draw(element, placement);
      } else if (!census_.extent(element.cell).is_empty()) {
        refer(element, placement);
      }
    }
  }

  void refer(const GdsElement& element, const Placement& placement) {
    const Extent& inner = census_.extent(element.cell);
    const auto placed = [&](int column, int row) {
      return combined(placement, placement_of(element, at(element, column, row)));
    };
    const auto [columns, rows] = ranges(element, placement, placed_extent(inner, placed(0, 0)));
    for (int column = columns.first; column <= columns.last; ++column) {
      for (int row = rows.first; row <= rows.last; ++row) {
        const Placement there = placed(column, row);
        if (placed_extent(inner, there).meets(window_)) place(element.cell, there);
      }
    }
  }

  /// Where the first one is known, the columns and rows that may meet the window.
  std::array<Range, 2> ranges(const GdsElement& element, const Placement& placement,
                              const Extent& first) const {
    std::array<Range, 2> all{{{0, element.columns - 1}, {0, element.rows - 1}}};
    if (element.kind != GdsElement::Kind::array_reference) return all;
    const auto step = [&](std::size_t which, int count) -> Eigen::Vector2d {
      const Eigen::Vector2d whole{element.points[which][0] - element.points[0][0],
                                  element.points[which][1] - element.points[0][1]};
      return placement.matrix * whole / count;
    };
    Eigen::Matrix2d steps;
    steps << step(1, element.columns), step(2, element.rows);
    // All that lie at one place are one.
    for (int axis = 0; axis < 2; ++axis)
      if (steps.col(axis).isZero(0)) all[axis].last = 0;
    // Along a single row any direction does for the other one.
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d other = steps.col(1 - axis);
      if (all[axis].last == 0) steps.col(axis) = Eigen::Vector2d{-other[1], other[0]};
    }
    if (std::abs(steps.determinant()) < 1e-9) return all;
    const Eigen::Matrix2d inverse = steps.inverse();
    std::array<double, 2> least{infinity, infinity};
    std::array<double, 2> most{-infinity, -infinity};
    for (const double x : {window_.lower[0] - first.upper[0], window_.upper[0] - first.lower[0]}) {
      for (const double y :
           {window_.lower[1] - first.upper[1], window_.upper[1] - first.lower[1]}) {
        if (!std::isfinite(x) || !std::isfinite(y)) return all;
        const Eigen::Vector2d index = inverse * Eigen::Vector2d{x, y};
        for (std::size_t axis = 0; axis < 2; ++axis) {
          least[axis] = std::min(least[axis], index[static_cast<int>(axis)]);
          most[axis] = std::max(most[axis], index[static_cast<int>(axis)]);
        }
      }
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto last = static_cast<double>(all[axis].last);
      all[axis].first = static_cast<int>(std::clamp(std::floor(least[axis]), 0.0, last + 1));
      all[axis].last = static_cast<int>(std::clamp(std::ceil(most[axis]), -1.0, last));
    }
    return all;
  }

  void draw(const GdsElement& element, const Placement& placement) {
    for (Loop& loop : loops_of(element, placement.scale())) {
      Extent extent;
      for (Point2& point : loop) {
        point = placement(point);
        extent.add(point);
        for (double& x : point) {
          x *= library_.unit;
          if (!(std::abs(x) <= longest_length)) {
            refuse_layout(file_,
                          "has a point more than 1 m away from its origin; is its database unit (" +
                              rounded_number(library_.unit) + " nm) right?");
          }
        }
      }
      if (!extent.meets(window_)) continue;
      if (layout_.loops.size() == most_loops) {
        refuse_layout(file_,
                      fmt::format("has more than {} shapes on the layer in the domain; choose "
                                  "a smaller cell or domain",
                                  most_loops));
      }
      layout_.loops.push_back(std::move(loop));
    }
  }

  void add_doubts(const std::string& cell) {
    const auto add = [&](const std::string& text) {
      layout_.doubts.push_back(shown(file_) + ": " + one_line(text));
    };
    if (!(library_.unit >= least_unit && library_.unit <= most_unit))
      add(fmt::format(
          "has a database unit of {} nm, and layer {} of cell {} is {} nm wide; are its "
          "two units swapped?",
          rounded_number(library_.unit), selection_.layer, cell,
          rounded_number(layout_.extent[1][0] - layout_.extent[0][0])));
    if (!selection_.datatype && census_.datatypes().size() > 1) {
      const std::string how = selection_.is_in_formula
                                  ? fmt::format("choose one by writing for example {}/{}",
                                                selection_.layer, *census_.datatypes().begin())
                                  : "choose one with datatype = ...";
      add(fmt::format("has layer {} in datatypes {}: all of them are taken; {}", selection_.layer,
                      fmt::join(census_.datatypes(), ", "), how));
    }
    if (census_.flat_count() > 0)
      add(fmt::format(
          "has {} without area on layer {}, which {} nothing; a path needs a width",
          census_.flat_count() == 1 ? "a shape" : fmt::format("{} shapes", census_.flat_count()),
          selection_.layer, census_.flat_count() == 1 ? "draws" : "draw"));
  }

  [[noreturn]] void refuse_layer(const std::string& cell) const {
    const std::string layer =
        std::to_string(selection_.layer) +
        (selection_.datatype ? '/' + std::to_string(*selection_.datatype) : "");
    if (census_.flat_count() > 0)
      refuse_layout(file_,
                    fmt::format("cell {} has on layer {} only shapes without area ({}): paths "
                                "without width or length, or boundaries of one line; give "
                                "paths a width",
                                cell, layer, census_.flat_count()));
    constexpr std::size_t most_told = 20;
    std::string known;
    std::size_t count = 0;
    for (const auto& [number, datatype] : census_.layers()) {
      if (count++ == most_told) known += ", ...";
      if (count > most_told) break;
      known +=
          (known.empty() ? "" : ", ") + std::to_string(number) + '/' + std::to_string(datatype);
    }
    refuse_layout(file_,
                  "cell " + repeated(cell) + " has nothing on layer " + layer +
                      (known.empty() ? "; it is empty" : "; it has layer/datatype " + known));
  }

  const std::filesystem::path& file_;
  const GdsLibrary& library_;
  const GdsSelection& selection_;
  Census census_;
  Extent window_;
  Layout layout_;
  std::size_t placements_ = 0;
};

/// "A, B, ..."
std::string first_of(std::span<const std::string> names) {
  constexpr std::size_t most_told = 10;
  std::string told;
  for (const std::string& name : names.first(std::min(names.size(), most_told)))
    told += (told.empty() ? "" : ", ") + repeated(name);
  return told + (names.size() > most_told ? ", ..." : "");
}

std::string chosen_cell(const std::filesystem::path& file, const GdsLibrary& library,
                        const std::string& wanted) {
  std::vector<std::string> names;
  std::set<std::string> inner;
  for (const auto& [name, elements] : library.cells) {
    names.push_back(name);
    for (const GdsElement& element : elements) inner.insert(element.cell);
  }
  if (!wanted.empty()) {
    if (library.cells.contains(wanted)) return wanted;
    refuse_layout(file, "has no cell " + repeated(wanted) + suggestion(wanted, names) +
                            "; it has " + first_of(names));
  }
  std::vector<std::string> tops;
  for (const std::string& name : names) {
    // KLayout keeps notes of its own in a cell.
    if (inner.contains(name) || name == "$$$CONTEXT_INFO$$$") continue;
    tops.push_back(name);
  }
  if (tops.empty())
    refuse_layout(file, "has no cell that no other refers to; name one with cell = ...");
  if (tops.size() > 1)
    refuse_layout(file, "has several cells that no other refers to; choose one with cell = ...: " +
                            first_of(tops));
  return tops.front();
}

}  // namespace

Layout read_gds(const std::filesystem::path& file, std::string_view content,
                const GdsSelection& selection) {
  const GdsLibrary library = read_gds_library(file, content);
  return Flattener(file, library, selection).run(chosen_cell(file, library, selection.cell));
}

std::vector<Layout> read_gds_layers(const std::filesystem::path& file, std::string_view content,
                                    GdsSelection selection, std::span<const GdsLayer> layers) {
  const GdsLibrary library = read_gds_library(file, content);
  const std::string cell = chosen_cell(file, library, selection.cell);
  std::vector<Layout> layouts;
  for (const GdsLayer& layer : layers) {
    selection.layer = layer.layer;
    selection.datatype = layer.datatype;
    layouts.push_back(Flattener(file, library, selection).run(cell));
  }
  return layouts;
}

}  // namespace scarp
