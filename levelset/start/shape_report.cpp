#include "levelset/start/shape_report.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/recipe/quantity.h"

namespace scarp {

namespace {

bool is_length(double length) { return std::isfinite(length) && length > 0; }

}  // namespace

std::string in_nm(double length) { return rounded_number(length) + " nm"; }

std::string place_text(Vec3d place) {
  return '(' + in_nm(place.x) + ", " + in_nm(place.y) + ", " + in_nm(place.z) + ')';
}

std::string place_text(const std::array<double, 2>& place) {
  return '(' + in_nm(place[0]) + ", " + in_nm(place[1]) + ')';
}

std::string size_text(const std::string& key, double size) {
  return (key.ends_with("radius") ? "a diameter of " : "") + in_nm(size);
}

std::string prefix_of(const std::string& key) { return key.substr(0, key.rfind('.') + 1); }

void ShapeReport::report(std::string key, std::string message) {
  problems_.push_back({shape_, std::move(key), std::move(message), false});
}

void ShapeReport::report_narrow(std::string key, std::string message, Between between) {
  problems_.push_back({shape_, std::move(key), std::move(message), between == Between::walls});
}

std::string ShapeReport::than_spacings() const {
  const std::string count = narrowest_ == thinnest_feature ? "two" : rounded_number(narrowest_);
  return "than " + count + " grid spacings (" + in_nm(narrow()) + ")";
}

bool ShapeReport::feature(const std::string& key, double width, Between between) {
  if (!is_length(width)) {
    report(key, "must be a length above 0");
  } else if (is_narrow(width)) {
    report_narrow(key, size_text(key, width) + " is thinner " + than_spacings(), between);
  } else {
    return true;
  }
  return false;
}

bool ShapeReport::height(const std::string& key, double length) {
  const double shortest = thinnest_feature * frame_.spacing;
  if (!is_length(length)) {
    report(key, "must be a length above 0");
  } else if (length < shortest * (1 - 1e-9)) {
    report(key, in_nm(length) + " is thinner than two grid spacings (" + in_nm(shortest) + ")");
  } else {
    return true;
  }
  return false;
}

bool ShapeReport::taper(double angle) {
  const bool is_good = std::abs(angle) < 0.49 * std::numbers::pi;
  if (!is_good) report("taper", "must lie between -88 deg and 88 deg");
  return is_good;
}

void ShapeReport::radius(const std::string& key, double value, double largest) {
  if (!(value >= 0 && value <= largest * (1 + 1e-9))) {
    report(key, "must lie between 0 nm and " + in_nm(std::max(largest, 0.0)));
  }
}

}  // namespace scarp
