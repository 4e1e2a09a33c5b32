#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/vec3.h"
#include "levelset/start/shapes.h"

namespace scarp {

/// Features thinner than this many spacings are refused: the band cannot hold both their sides.
constexpr double thinnest_feature = 2;

/// What a narrow place lies between: the walls of an opening, or the sides of a solid.
enum class Between { walls, sides };

/// As messages have them.
std::string in_nm(double length);
std::string place_text(Vec3d place);
std::string place_text(const std::array<double, 2>& place);

/// The size across a shape, which a radius gives half of.
std::string size_text(const std::string& key, double size);

/// The tables that a key names before itself: "resist." of "resist.width".
std::string prefix_of(const std::string& key);

/// What is wrong with the shapes, and the rules for single sizes.
class ShapeReport {
 public:
  /// Units: the least width of a feature in spacings.
  ShapeReport(const Frame& frame, double narrowest) : frame_(frame), narrowest_(narrowest) {}

  /// Of which shape is spoken from here on.
  void turn_to(std::size_t shape) { shape_ = shape; }
  std::vector<ShapeProblem> take() { return std::move(problems_); }

  void report(std::string key, std::string message);

  void report_narrow(std::string key, std::string message, Between between);

  double narrow() const { return narrowest_ * frame_.spacing; }

  bool is_narrow(double width) const { return width < narrow() * (1 - 1e-9); }

  /// "less than two grid spacings (20 nm)" without the first word.
  std::string than_spacings() const;

  /// A width that is not too narrow: a length, or twice a radius.
  bool feature(const std::string& key, double width, Between between);

  /// A height of at least two spacings.
  bool height(const std::string& key, double length);

  bool taper(double angle);

  void radius(const std::string& key, double value, double largest);

 private:
  const Frame& frame_;
  double narrowest_;
  std::size_t shape_ = 0;
  std::vector<ShapeProblem> problems_;
};

}  // namespace scarp
