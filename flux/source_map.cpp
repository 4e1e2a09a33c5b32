#include "flux/source_map.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/recipe/quantity.h"

namespace scarp {

namespace {

// Between two lines, and how far into the space between them.
struct Place {
  std::size_t above = 1;
  double part = 0;
};

Place between(std::span<const double> lines, double at) {
  const auto above = std::upper_bound(lines.begin() + 1, lines.end() - 1, at);
  const auto k = static_cast<std::size_t>(above - lines.begin());
  return {k, std::clamp((at - lines[k - 1]) / (lines[k] - lines[k - 1]), 0.0, 1.0)};
}

double blend(double low, double high, double part) { return low + part * (high - low); }

void check_lines(std::span<const double> lines, const Sides& sides, int axis) {
  const std::string name = axis == 0 ? "x" : "y";
  for (std::size_t k = 0; k < lines.size(); ++k) {
    if (!std::isfinite(lines[k]) || (k > 0 && !(lines[k] > lines[k - 1])))
      throw InputError("the lines of a map along " + name + " have to ascend");
  }
  const auto side = static_cast<std::size_t>(axis);
  const double rounding = 1e-9 * sides.width(axis);
  if (lines.size() >= 2 && lines.front() <= sides.lower[side] + rounding &&
      lines.back() >= sides.upper[side] - rounding) {
    return;
  }
  const auto text = [](double r) { return format_quantity(r, Dimension::length); };
  throw InputError("does not reach over the domain, which goes along " + name + " from " +
                   text(sides.lower[side]) + " to " + text(sides.upper[side]));
}

// The sides of the domain and the lines between them, in parts of its width.
std::vector<double> inside(std::span<const double> lines, const Sides& sides, int axis) {
  const double lower = sides.lower[static_cast<std::size_t>(axis)];
  std::vector<double> parts{0};
  for (const double line : lines) {
    const double part = (line - lower) / sides.width(axis);
    if (part > parts.back() && part < 1) parts.push_back(part);
  }
  parts.push_back(1);
  return parts;
}

}  // namespace

SourceMap::SourceMap(std::span<const double> x, std::span<const double> y,
                     std::span<const double> density, const Sides& sides) {
  SCARP_ASSERT(density.size(), ==, x.size() * std::max<std::size_t>(y.size(), 1));
  check_lines(x, sides, 0);
  if (y.size() > 1) check_lines(y, sides, 1);
  for (const double value : density) {
    if (!(value >= 0) || !std::isfinite(value))
      throw InputError("a density is negative or not finite");
  }
  const auto given = [&](double at_x, double at_y) {
    const Place i = between(x, at_x);
    const auto along = [&](std::size_t j) {
      const std::size_t count = std::max<std::size_t>(y.size(), 1);
      return blend(density[(i.above - 1) * count + j], density[i.above * count + j], i.part);
    };
    if (y.size() < 2) return along(0);
    const Place j = between(y, at_y);
    return blend(along(j.above - 1), along(j.above), j.part);
  };
  x_ = inside(x, sides, 0);
  y_ = inside(y.size() < 2 ? std::span<const double>{} : y, sides, 1);
  std::vector<double> whole;  // integral over y, of each line along y
  for (const double part_x : x_) {
    double sum = 0;
    for (std::size_t j = 0; j < y_.size(); ++j) {
      value_.push_back(
          given(sides.lower[0] + part_x * sides.width(0), sides.lower[1] + y_[j] * sides.width(1)));
      if (j > 0) sum += (y_[j] - y_[j - 1]) * (value_[value_.size() - 2] + value_.back()) / 2;
      below_.push_back(sum);
    }
    whole.push_back(sum);
  }
  along_x_ = LinearDensity(x_, whole);
  double mean = 0;
  for (std::size_t i = 1; i < x_.size(); ++i)
    mean += (x_[i] - x_[i - 1]) * (whole[i - 1] + whole[i]) / 2;
  for (double& each : value_) each /= mean;
  for (double& each : below_) each /= mean;
}

double SourceMap::at(double x, double y) const {
  const Place i = between(x_, x);
  const Place j = between(y_, y);
  const auto along = [&](std::size_t line) {
    return blend(value(i.above - 1, line), value(i.above, line), i.part);
  };
  return blend(along(j.above - 1), along(j.above), j.part);
}

// By its density along x, then along y at that x: there integrals are as linear in x as values are.
std::array<double, 2> SourceMap::place(UnitSquare xi) const {
  const double x = along_x_.quantile(xi.xi1);
  const Place i = between(x_, x);
  const auto at_x = [&](const std::vector<double>& values, std::size_t j) {
    const std::size_t low = (i.above - 1) * y_.size() + j;
    return blend(values[low], values[low + y_.size()], i.part);
  };
  const double wanted = xi.xi2 * at_x(below_, y_.size() - 1);
  std::size_t j = 1;
  for (std::size_t end = y_.size() - 1; j < end;) {
    const std::size_t middle = (j + end) / 2;
    if (at_x(below_, middle) < wanted) {
      j = middle + 1;
    } else {
      end = middle;
    }
  }
  const double step = reach({.width = y_[j] - y_[j - 1],
                             .low = at_x(value_, j - 1),
                             .high = at_x(value_, j),
                             .part = wanted - at_x(below_, j - 1)});
  return {x, y_[j - 1] + step};
}

}  // namespace scarp
