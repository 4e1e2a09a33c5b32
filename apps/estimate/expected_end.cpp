#include "apps/estimate/expected_end.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scarp {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t most_lines = 400;
constexpr float least_slope = 0.7F;  // of the normal's z: what counts as facing upwards

using Kind = EndCondition::Kind;

// A facet that faces upwards, and what lies straight below the middle of it.
class LineDown {
 public:
  LineDown(const State& state, const Survey& survey, std::size_t facet)
      : state_(state), survey_(survey), facet_(facet) {
    for (const Vec3d& corner : corners(survey.facets, facet)) top_ = top_ + corner / 3.0;
  }

  double height() const { return top_.z; }

  // Of a layer, if it were seen here. Units: nm/s.
  double speed(std::size_t layer) const {
    const auto& [a, b, c] = survey_.speeds_of_layers[layer].speed[facet_];
    return (static_cast<double>(a) + b + c) / 3;
  }

  // Down to a height.
  double time_to_height(double end) const {
    double time = 0;
    descend([&](double upper, double lower, std::size_t layer) {
      if (upper <= end) return false;
      time += etch_time(layer, upper - std::max(lower, end));
      return true;
    });
    return time;
  }

  // Until is_end(material) holds of what is seen; infinity if it never does.
  template <class IsEnd>
  double time_until(const IsEnd& is_end) const {
    double time = 0;
    descend([&](double upper, double lower, std::size_t layer) {
      if (is_end(state_.layers.stack[layer].material)) return false;
      time += etch_time(layer, upper - lower);
      return true;
    });
    return time;
  }

 private:
  // visit(upper, lower, layer) gets the parts from the surface down until it is false; the last one
  // is all that lies below.
  template <class Visit>
  void descend(const Visit& visit) const {
    const double part = 0.25 * state_.layers.frame.spacing;
    const double lowest = state_.layers.stack.front().phi.lower();
    double upper = top_.z;
    while (upper > lowest) {
      if (!visit(upper, upper - part, layer_at(upper - 0.5 * part))) return;
      upper -= part;
    }
    visit(upper, -infinity, 0);
  }

  double etch_time(std::size_t layer, double length) const {
    return speed(layer) < 0 ? length / -speed(layer) : infinity;
  }

  std::size_t layer_at(double z) const {
    const auto& stack = state_.layers.stack;
    std::size_t layer = 0;
    while (layer + 1 < stack.size() && !(stack[layer].phi.distance({top_.x, top_.y, z}) < 0))
      ++layer;
    return layer;
  }

  const State& state_;
  const Survey& survey_;
  std::size_t facet_;
  Vec3d top_{};
};

// All that face upwards, or some of them, evenly picked; at a place, the one next to it.
std::vector<LineDown> lines_of(const EndCondition& condition, const State& state,
                               const Survey& survey) {
  const std::vector<Vec3f> normals = facet_normals(survey.facets);
  std::vector<LineDown> lines;
  std::vector<std::size_t> upward;
  for (std::size_t f = 0; f < normals.size(); ++f)
    if (normals[f].z > least_slope) upward.push_back(f);
  if (condition.place) {
    const auto distance = [&](std::size_t f) {
      const auto [a, b, c] = corners(survey.facets, f);
      const Vec3d r = (a + b + c) / 3.0;
      return std::hypot(r.x - (*condition.place)[0], r.y - (*condition.place)[1]);
    };
    const auto nearest = std::ranges::min_element(upward, {}, distance);
    if (nearest != upward.end()) lines.emplace_back(state, survey, *nearest);
    return lines;
  }
  const std::size_t stride = upward.size() / most_lines + 1;
  for (std::size_t n = 0; n < upward.size(); n += stride)
    lines.emplace_back(state, survey, upward[n]);
  return lines;
}

double film_time(const EndCondition& condition, std::span<const LineDown> lines,
                 std::size_t top_layer) {
  const auto highest = std::ranges::max_element(lines, {}, &LineDown::height);
  if (highest == lines.end() || !(highest->speed(top_layer) > 0)) return infinity;
  return condition.length / highest->speed(top_layer);
}

double depth_time(const EndCondition& condition, std::span<const LineDown> lines,
                  const State& state) {
  const std::optional<double> start = start_height(condition, state.layers);
  const auto lowest = std::ranges::min_element(lines, {}, &LineDown::height);
  if (lowest == lines.end() || !start) return infinity;
  const double end = *start - condition.length;
  return lowest->time_to_height(end);
}

// The first line in which the material becomes exposed.
double exposed_time(MaterialId wanted, std::span<const LineDown> lines) {
  double first = infinity;
  for (const LineDown& line : lines) {
    first =
        std::min(first, line.time_until([&](MaterialId material) { return material == wanted; }));
  }
  return first;
}

// The last line in which it goes, of those that have some.
double gone_time(MaterialId wanted, std::span<const LineDown> lines) {
  double last = 0;
  for (const LineDown& line : lines) {
    bool was_there = false;
    const double time = line.time_until([&](MaterialId material) {
      was_there = was_there || material == wanted;
      return was_there && material != wanted;
    });
    if (was_there) last = std::max(last, time);
  }
  return last > 0 ? last : infinity;
}

}  // namespace

double expected_duration(const ProcessStep& step, const State& state, const Survey& survey) {
  if (!step.until) return step.duration;
  const double elapsed = state.time - state.step_start;
  if (state.progress.reached)
    return std::min(step.duration, end_of_over_etch(state, step) - state.step_start);
  const EndCondition& condition = *step.until;
  const std::vector<LineDown> lines = lines_of(condition, state, survey);
  const double time = [&] {
    switch (condition.kind) {
      case Kind::depth:
        return elapsed + depth_time(condition, lines, state);
      case Kind::thickness:
        return std::max(elapsed, film_time(condition, lines, state.layers.stack.size() - 1));
      case Kind::exposed:
        return elapsed + exposed_time(*condition.material, lines);
      default:
        return elapsed + gone_time(*condition.material, lines);
    }
  }();
  return time > 0 ? std::min(step.duration, (1 + condition.over_etch) * time) : step.duration;
}

}  // namespace scarp
