#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/grid/welded.h"
#include "levelset/start/mesh_solid.h"
#include "levelset/start/outline_checks.h"
#include "levelset/start/place_checks.h"
#include "levelset/start/polygon_walls.h"
#include "levelset/start/shape_builder.h"
#include "levelset/start/shape_report.h"
#include "levelset/start/shapes.h"

namespace scarp {

namespace {

/// Every layer is a level set of its own, and every point is compared with every shape.
constexpr std::size_t most_layers = 200;
constexpr std::size_t most_shapes = 1000;

/// From the deepest cut to the highest top, in spacings.
constexpr double most_levels = 1e5;

/// A count that may be too large for an integer.
std::string whole_text(double count) {
  return count < 1e15 ? std::to_string(static_cast<long long>(count)) : "more than 1e15";
}

/// The widest place of an opening whose walls run from the mouth to the depth.
double widest(double width, const Cut& cut) {
  return std::max(width, width - 2 * cut.depth * std::tan(cut.taper));
}

/// What the shapes so far make together: layers, and a height.
class StackLimits {
 public:
  StackLimits(double spacing, ShapeReport& report) : spacing_(spacing), report_(report) {}

  void begin_on(const Ground& ground) {
    layer_count_ = static_cast<double>(ground.materials.size());
    lowest_ = ground.lowest;
    highest_ = ground.highest;
  }

  double lowest() const { return lowest_; }
  double highest() const { return highest_; }

  /// Counts layers that a shape adds.
  void add_layers(const std::string& key, double count) {
    const double before = layer_count_;
    layer_count_ += count;
    if (layer_count_ > most_layers && before <= most_layers) {
      report_.report(key, "makes " + whole_text(layer_count_) +
                              " layers with those below; at most " + std::to_string(most_layers) +
                              " can be told apart");
    }
  }

  /// The stack reaches from the lowest cut to the top of what was added.
  /// Whether all so far is low enough.
  bool reach(const std::string& key, double lowest, double highest) {
    const double limit = most_levels * spacing_;
    const bool was_fine = highest_ - lowest_ <= limit;
    lowest_ = std::min(lowest_, lowest);
    highest_ = std::max(highest_, highest);
    if (was_fine && highest_ - lowest_ > limit) {
      report_.report(key, "makes the geometry " + whole_text((highest_ - lowest_) / spacing_) +
                              " grid spacings high; at most " + whole_text(most_levels) + ": " +
                              in_nm(limit));
    }
    return highest_ - lowest_ <= limit;
  }

 private:
  double spacing_;
  ShapeReport& report_;
  double layer_count_ = 0;
  double lowest_ = 0;
  double highest_ = 0;
};

/// Bodies that meshes and profiles draw.
class BodyChecks {
 public:
  BodyChecks(const Frame& frame, ShapeReport& report, PlaceChecks& places, StackLimits& stack)
      : frame_(frame), sides_(frame.sides()), report_(report), places_(places), stack_(stack) {}

  void check(const MeshShape& s) {
    if (frame_.is_section()) {
      report_.report("shape",
                     "meshes need three dimensions, or a plane in which they are cut: section = "
                     "\"y = 0 nm\"");
      return;
    }
    const TriMesh mesh = welded(*s.mesh);
    if (const auto fault = mesh_fault(frame_, mesh)) {
      report_.report("file", *fault);
      return;
    }
    const Box box = bounding_box(mesh);
    mesh_size(mesh, box);
    stack_.reach("file", box.lower.z, box.upper.z);
  }

  void check(const ProfileShape& s) {
    if (!frame_.is_slice()) {
      report_.report("shape", "a profile needs mode = \"2d\"");
    } else if (!s.loops.empty()) {
      profile(s);
    }
  }

 private:
  /// The walls of a profile cross nowhere and are far enough from each other.
  void profile(const ProfileShape& s) {
    const auto [lower, upper] = heights_of(s);
    if (!stack_.reach("points", lower, upper)) return;
    const double far = 32 * frame_.spacing;
    std::vector<Loop> loops = closed_profile(s, s.material ? lower - far : upper + far);
    if (const auto fault = polygon_fault(loops)) {
      report_.report("points", *fault);
      return;
    }
    loops = in_period(frame_, s, std::move(loops));
    const Frame plane = profile_frame(frame_, loops);
    const std::vector<Loop> walls = domain_loops(plane, {loops});
    if (walls.empty()) {
      report_.report("points", "lies wholly outside the domain, which reaches from x = " +
                                   in_nm(sides_.lower[0]) + " to " + in_nm(sides_.upper[0]));
    } else if (const auto fault = thin_feature(plane, walls, report_.narrow())) {
      report_.report_narrow("points", *fault, Between::sides);
    }
  }

  /// Something of a mesh is in the domain, and no body of it is lost between the nodes.
  void mesh_size(const TriMesh& mesh, const Box& box) {
    for (int axis = 0; axis < 2; ++axis) {
      if (box.upper[axis] <= sides_.lower[axis] || box.lower[axis] >= sides_.upper[axis]) {
        places_.report_outside("file");
        return;
      }
    }
    if (mesh_border(mesh) > 0) return;
    if (places_.is_endless("file", {box.lower.x, box.lower.y}, {box.upper.x, box.upper.y})) return;
    for (const TriMesh& part : separate_parts(mesh)) {
      const double thick = thickness(part);
      if (report_.is_narrow(thick)) {
        const Box body = bounding_box(part);
        const Vec3d size = body.upper - body.lower;
        report_.report_narrow("file",
                              "has a body around " + place_text(0.5 * (body.lower + body.upper)) +
                                  " that is " + in_nm(thick) + " thick and " +
                                  in_nm(std::max({size.x, size.y, size.z})) + " long, thinner " +
                                  report_.than_spacings() +
                                  "; choose a smaller spacing, or another unit if that is wrong",
                              Between::sides);
        return;
      }
    }
  }

  const Frame& frame_;
  Sides sides_;
  ShapeReport& report_;
  PlaceChecks& places_;
  StackLimits& stack_;
};

/// Goes through the shapes from the wafer up, with the stack that they make.
class Checker {
 public:
  /// Units: the least width of a feature in spacings.
  Checker(const Frame& frame, double narrowest)
      : frame_(frame),
        report_(frame, narrowest),
        places_(frame, report_),
        stack_(frame.spacing, report_) {}

  /// The shapes act on what is there already.
  void begin_on(const Ground& ground) {
    has_ground_ = true;
    stack_.begin_on(ground);
    materials_ = ground.materials;
  }

  std::vector<ShapeProblem> run(std::span<const Shape> shapes) {
    if (shapes.empty() && !has_ground_) {
      report_.report("shape", "there is no shape; the first must be a wafer");
    }
    if (shapes.size() > most_shapes) {
      report_.turn_to(most_shapes);
      report_.report("shape", "is one of " + std::to_string(shapes.size()) + " shapes, at most " +
                                  std::to_string(most_shapes) +
                                  " can be; draw what is alike with repeat, polygons or a layout");
      return report_.take();
    }
    for (std::size_t n = 0; n < shapes.size(); ++n) {
      report_.turn_to(n);
      const bool is_wafer = std::holds_alternative<WaferShape>(shapes[n]);
      if (is_wafer && has_ground_) {
        report_.report("shape", "there is a wafer already; leave this one out");
      } else if (is_wafer != (n == 0) && !has_ground_) {
        report_.report("shape", is_wafer ? "a wafer can only be the first shape"
                                         : "the first shape must be a wafer");
      }
      std::visit([&](const auto& s) { check(s); }, shapes[n]);
    }
    return report_.take();
  }

 private:
  void known(const std::string& key, MaterialId material) {
    if (std::find(materials_.begin(), materials_.end(), material) == materials_.end()) {
      report_.report(key, "this material is not in the stack below");
    }
  }

  /// The narrow end must not close: the floor is at least two spacings wide. What follows from a
  /// width or a depth that is wrong itself is not told.
  void cut(const Cut& cut, double width, bool width_is_good) {
    report_.taper(cut.taper);
    if (cut.depth_from) {
      known("depth_from", *cut.depth_from);
    }
    for (const MaterialId material : cut.through) {
      known("through", material);
    }
    const double floor = width - 2 * cut.depth * std::tan(cut.taper);
    const bool depth_is_good = report_.height("depth", cut.depth);
    stack_.reach("depth", stack_.highest() - cut.depth, stack_.highest());
    if (depth_is_good) report_.radius("top_radius", cut.top_radius, cut.depth);
    if (depth_is_good && width_is_good) {
      if (report_.is_narrow(floor)) {
        report_.report_narrow("taper",
                              "leaves a floor of " + in_nm(std::max(floor, 0.0)) +
                                  " at this depth: less " + report_.than_spacings(),
                              Between::walls);
      } else {
        report_.radius("bottom_radius", cut.bottom_radius, std::min(cut.depth, 0.5 * floor));
      }
    }
    if (cut.top_radius > 0 && has_ground_) {
      report_.report("top_radius", "is known for the first wafer of a flow only; leave it out");
    }
    if (cut.top_radius > 0 && !cut.through.empty()) {
      report_.report("top_radius", "cannot be rounded where only some materials are cut (through)");
    }
  }

  void check(const WaferShape& s) { materials_.push_back(s.material); }

  void check(const LayerShape& s) {
    if (!std::isfinite(s.thickness) || s.thickness <= 0) {
      report_.report("thickness", "must be a length above 0");
    }
    stack_.add_layers("thickness", 1);
    stack_.reach("thickness", stack_.lowest(), stack_.highest() + s.thickness);
    materials_.push_back(s.material);
  }

  void check(const StackShape& s) {
    if (s.layers.empty()) report_.report("materials", "there is no layer");
    if (s.count < 1) report_.report("count", "must be 1 or more");
    for (const LayerShape& layer : s.layers) check(layer);
    // The first of the copies is counted with its layers.
    const double copies = std::max(s.count - 1, 0);
    double thickness = 0;
    for (const LayerShape& layer : s.layers) thickness += layer.thickness;
    stack_.add_layers("count", copies * static_cast<double>(s.layers.size()));
    stack_.reach("count", stack_.lowest(), stack_.highest() + copies * thickness);
  }

  void check(const TrenchShape& s) {
    if (s.is_everywhere) {
      cut(s.cut, 0, false);
      return;
    }
    const bool is_good = report_.feature("width", s.width, Between::walls);
    if (is_good)
      places_.row("", s.along, s.centre, widest(s.width, s.cut), s.repeat, Between::walls);
    cut(s.cut, s.width, is_good);
  }

  void check(const HoleShape& s) {
    const bool is_good = places_.round_outline(
        "", s.centre, s.radius, 0.5 * widest(2 * s.radius, s.cut), s.repeat, Between::walls);
    cut(s.cut, 2 * s.radius, is_good);
  }

  void check(const FinShape& s) {
    report_.taper(s.taper);
    const bool width_is_good = report_.feature("width", s.width, Between::sides);
    if (width_is_good) places_.row("", s.along, s.centre, s.width, s.repeat, Between::sides);
    const double ridge = s.width - 2 * s.height * std::tan(s.taper);
    if (report_.height("height", s.height) && width_is_good && report_.is_narrow(ridge)) {
      report_.report_narrow("taper", "leaves a ridge of less " + report_.than_spacings(),
                            Between::sides);
    }
    stack_.add_layers("material", 1);
    stack_.reach("height", stack_.lowest(), stack_.highest() + s.height);
    materials_.push_back(s.material);
  }

  void check(const MaskShape& s) {
    const bool thickness_is_good = report_.height("thickness", s.thickness);
    const bool has_growth = report_.taper(s.taper) && thickness_is_good;
    stack_.add_layers("material", 1);
    stack_.reach("thickness", stack_.lowest(), stack_.highest() + s.thickness);
    const bool opening = s.outlines == MaskShape::Outlines::opening;
    const double growth = has_growth ? (opening ? 1 : -1) * s.thickness * std::tan(s.taper) : 0;
    const std::string prefix = opening ? "opening." : "resist.";
    OutlineChecks outlines(frame_, report_, places_, opening ? Between::walls : Between::sides);
    std::visit([&](const auto& outline) { outlines.check(prefix, outline, growth); }, s.outline);
    materials_.push_back(s.material);
  }

  void check(const MeshShape& s) { check_body(s); }
  void check(const ProfileShape& s) { check_body(s); }

  template <typename Body>
  void check_body(const Body& s) {
    BodyChecks(frame_, report_, places_, stack_).check(s);
    stack_.add_layers("material", s.material ? 1 : 0);
    if (s.material) materials_.push_back(*s.material);
  }

  const Frame& frame_;
  ShapeReport report_;
  PlaceChecks places_;
  StackLimits stack_;
  std::vector<MaterialId> materials_;
  bool has_ground_ = false;
};

}  // namespace

std::vector<ShapeProblem> check_shapes(const Frame& frame, std::span<const Shape> shapes) {
  return Checker(frame, thinnest_feature).run(shapes);
}

std::vector<ShapeProblem> check_shapes_on(const Frame& frame, std::span<const Shape> shapes,
                                          const Ground& ground) {
  Checker checker(frame, thinnest_feature);
  checker.begin_on(ground);
  return checker.run(shapes);
}

std::vector<ShapeProblem> narrow_features(const Frame& frame, std::span<const Shape> shapes,
                                          double width, const std::optional<Ground>& ground) {
  Checker checker(frame, width / frame.spacing);
  if (ground) checker.begin_on(*ground);
  return checker.run(shapes);
}

}  // namespace scarp
