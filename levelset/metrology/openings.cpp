#include "levelset/metrology/openings.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace scarp {

/// One piece of what lies lower than some height, from a node on.
class OpeningMap::Flood {
 public:
  Flood(const OpeningMap& map, const ViewFromAbove& view, std::size_t start, double below,
        std::vector<Mark>& marks)
      : map_(map), view_(view), below_(below), marks_(marks) {
    const auto width = static_cast<std::size_t>(map.nodes_[1]);
    const std::array<int, 2> node{static_cast<int>(start / width), static_cast<int>(start % width)};
    reach(node, node);
    for (std::size_t n = 0; n < places_.size(); ++n) spread(places_[n]);
    const std::array<double, 2> middle = middle_of_area();
    for (int axis = 0; axis < 2; ++axis) measure(axis, middle[axis]);
    for (const std::size_t place : places_) marks_[place].is_reached = false;
  }

  const std::vector<std::size_t>& places() const { return places_; }
  const std::array<bool, 2>& through() const { return through_; }
  const std::array<double, 2>& centre() const { return centre_; }
  const std::array<double, 2>& width() const { return width_; }

 private:
  void reach(const std::array<int, 2>& node, const std::array<int, 2>& unfolded) {
    const std::size_t place = map_.place(node[0], node[1]);
    if (!(map_.heights_[place] < below_)) return;
    Mark& mark = marks_[place];
    if (mark.is_reached) {
      // On another way around a periodic side.
      for (int axis = 0; axis < 2; ++axis)
        through_[axis] = through_[axis] || mark.unfolded[axis] != unfolded[axis];
      return;
    }
    mark = {.is_reached = true, .unfolded = unfolded};
    places_.push_back(place);
  }

  /// A reflective side.
  bool is_beyond(const std::array<int, 2>& unfolded) const {
    for (int axis = 0; axis < 2; ++axis)
      if (map_.frame_.boundary[axis] == Boundary::reflective &&
          (unfolded[axis] < 0 || unfolded[axis] >= map_.nodes_[axis]))
        return true;
    return false;
  }

  // Across corners, too: what a sharp corner of an opening has of nodes touches in these alone.
  void spread(std::size_t place) {
    const std::array<int, 2> unfolded = marks_[place].unfolded;
    for (const int i : {-1, 1})
      for (const int j : {-1, 1})
        if (const std::array<int, 2> next{unfolded[0] + i, unfolded[1] + j}; !is_beyond(next))
          reach({map_.fold(0, next[0]), map_.fold(1, next[1])}, next);
    for (int axis = 0; axis < 2; ++axis) {
      for (const int step : {-1, 1}) {
        std::array<int, 2> next = unfolded;
        next[axis] += step;
        if (is_beyond(next)) {
          on_side_[axis][step > 0 ? 1 : 0] = true;
        } else {
          reach({map_.fold(0, next[0]), map_.fold(1, next[1])}, next);
        }
      }
    }
  }

  bool is_reached(const std::array<int, 2>& unfolded) const {
    const Mark& mark = marks_[map_.place(map_.fold(0, unfolded[0]), map_.fold(1, unfolded[1]))];
    return mark.is_reached && mark.unfolded == unfolded;
  }

  bool is_inside(const std::array<int, 2>& unfolded) const {
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        if (!is_reached({unfolded[0] + i, unfolded[1] + j})) return false;
    return true;
  }

  /// The middle of the area, unfolded, as indices of nodes. What counts of the cells at its border
  /// are samples: with whole cells it would depend on where the nodes lie.
  std::array<double, 2> middle_of_area() const {
    constexpr int samples = 8;  // along an axis
    std::array<double, 2> sum{};
    double count = 0;
    const auto add = [&](double x, double y, double weight) {
      sum[0] += weight * x;
      sum[1] += weight * y;
      count += weight;
    };
    std::set<std::array<int, 2>> at_border;
    for (const std::size_t place : places_) {
      const std::array<int, 2> node = marks_[place].unfolded;
      if (is_inside(node)) {
        add(node[0], node[1], samples * samples);
        continue;
      }
      for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
          if (!is_inside({node[0] + i, node[1] + j})) at_border.insert({node[0] + i, node[1] + j});
    }
    for (const auto& [i, j] : at_border) {
      for (int a = 0; a < samples; ++a) {
        for (int b = 0; b < samples; ++b) {
          const double x = i + (a + 0.5) / samples - 0.5;
          const double y = j + (b + 0.5) / samples - 0.5;
          if (is_lower_at(x, y)) add(x, y, 1);
        }
      }
    }
    return {sum[0] / count, sum[1] / count};
  }

  /// At a place between nodes; nothing is beyond reflective sides.
  bool is_lower_at(double x, double y) const {
    std::array<double, 2> at{x, y};
    for (int axis = 0; axis < 2; ++axis) {
      const int cells = map_.frame_.cells[axis];
      if (map_.frame_.boundary[axis] == Boundary::periodic)
        at[axis] -= cells * std::floor(at[axis] / cells);
      if (at[axis] < 0 || at[axis] > cells) return false;
      at[axis] = map_.frame_.node_position(axis, at[axis]);
    }
    const auto seen = view_.at(at);
    return seen && seen->height < below_;
  }

  void measure(int axis, double middle) {
    int first = marks_[places_.front()].unfolded[axis];
    int last = first;
    for (const std::size_t place : places_) {
      const int index = marks_[place].unfolded[axis];
      first = std::min(first, index);
      last = std::max(last, index);
    }
    const Sides sides = map_.frame_.sides();
    const auto [on_lower, on_upper] = on_side_[axis];
    const bool is_around_axis = map_.frame_.is_around_axis() && axis == 1;
    if (map_.frame_.is_around_axis()) {
      // What reaches the side lies around what stands on the axis.
      through_[axis] = on_side_[0][0] || on_side_[0][1];
    } else {
      through_[axis] = through_[axis] || (on_lower && on_upper);
    }
    width_[axis] = (last - first + 1) * map_.frame_.spacing;
    double& centre = centre_[axis];
    centre = map_.frame_.node_position(axis, middle);
    if (through_[axis]) {
      centre = 0;
    } else if (is_around_axis) {
      centre = 0;
    } else if (on_lower || on_upper) {
      centre = on_lower ? sides.lower[axis] : sides.upper[axis];
      width_[axis] = 2 * width_[axis] - map_.frame_.spacing;
    } else if (map_.frame_.boundary[axis] == Boundary::periodic) {
      const double from = sides.lower[axis] - 0.5 * map_.frame_.spacing;
      centre -= sides.width(axis) * std::floor((centre - from) / sides.width(axis));
    }
  }

  const OpeningMap& map_;
  const ViewFromAbove& view_;
  double below_;
  std::vector<Mark>& marks_;
  std::vector<std::size_t> places_;
  std::array<std::array<bool, 2>, 2> on_side_{};  ///< reflective ones, of each axis
  std::array<bool, 2> through_{};
  std::array<double, 2> centre_{};
  std::array<double, 2> width_{};
};

OpeningMap::OpeningMap(const ViewFromAbove& view, const Frame& frame,
                       std::span<const ViewFromAbove* const> below)
    : frame_(frame) {
  for (int axis = 0; axis < 2; ++axis)
    nodes_[axis] = frame.cells[axis] + (frame.boundary[axis] == Boundary::reflective ? 1 : 0);
  double highest = -1e300;
  for (int i = 0; i < nodes_[0]; ++i) {
    for (int j = 0; j < nodes_[1]; ++j) {
      const auto seen = view.at({frame.node_position(0, i), frame.node_position(1, j)});
      // Where nothing is seen there is nothing to measure either.
      heights_.push_back(seen ? seen->height : 1e300);
      if (seen) highest = std::max(highest, seen->height);
    }
  }
  labels_.assign(heights_.size(), none);
  is_plugged_.assign(heights_.size(), false);
  find(view, highest);
  for (const ViewFromAbove* each : below) add_plugged(OpeningMap(*each, frame));
}

// Openings of a lower surface over which none of this one lies.
void OpeningMap::add_plugged(const OpeningMap& below) {
  std::vector<bool> is_open(below.openings_.size(), false);
  for (std::size_t n = 0; n < labels_.size(); ++n) {
    if (below.labels_[n] != none && labels_[n] != none)
      is_open[static_cast<std::size_t>(below.labels_[n])] = true;
  }
  for (std::size_t n = 0; n < labels_.size(); ++n) {
    if (below.labels_[n] != none && !is_open[static_cast<std::size_t>(below.labels_[n])])
      is_plugged_[n] = true;
  }
}

void OpeningMap::find(const ViewFromAbove& view, double highest) {
  std::vector<std::size_t> lowest_first(heights_.size());
  std::iota(lowest_first.begin(), lowest_first.end(), 0);
  std::stable_sort(lowest_first.begin(), lowest_first.end(),
                   [&](std::size_t a, std::size_t b) { return heights_[a] < heights_[b]; });
  std::vector<Mark> marks(heights_.size());
  std::vector<bool> is_done(heights_.size(), false);
  for (const std::size_t place : lowest_first) {
    if (!is_deep(highest - heights_[place], frame_.spacing)) break;
    if (is_done[place]) continue;
    const Flood flood(*this, view, place, 0.5 * (highest + heights_[place]), marks);
    bool is_new = true;
    for (const std::size_t each : flood.places()) {
      is_new = is_new && labels_[each] == none;
      is_done[each] = true;
    }
    if (!is_new) continue;
    openings_.push_back({.centre = flood.centre(),
                         .through = flood.through(),
                         .lowest = heights_[place],
                         .width = flood.width()});
    for (const std::size_t each : flood.places())
      labels_[each] = static_cast<int>(openings_.size()) - 1;
  }
  sort();
}

std::vector<std::size_t> OpeningMap::order() const {
  std::vector<std::size_t> order(openings_.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t n) { return openings_[n].centre[0]; });
  std::vector<std::size_t> column(order.size());
  for (std::size_t n = 1; n < order.size(); ++n) {
    const double step = openings_[order[n]].centre[0] - openings_[order[n - 1]].centre[0];
    column[order[n]] = column[order[n - 1]] + (step < frame_.spacing ? 0 : 1);
  }
  std::ranges::stable_sort(
      order, {}, [&](std::size_t n) { return std::pair(column[n], openings_[n].centre[1]); });
  return order;
}

void OpeningMap::sort() {
  const std::vector<std::size_t> order = this->order();
  std::vector<Opening> sorted;
  std::vector<int> label(order.size());
  for (const std::size_t n : order) {
    label[n] = static_cast<int>(sorted.size());
    sorted.push_back(openings_[n]);
  }
  openings_ = std::move(sorted);
  for (int& each : labels_)
    if (each != none) each = label[static_cast<std::size_t>(each)];
}

int OpeningMap::fold(int axis, int index) const {
  const int cells = frame_.cells[axis];
  const int period = frame_.boundary[axis] == Boundary::periodic ? cells : 2 * cells;
  const int wrapped = ((index % period) + period) % period;
  return wrapped < nodes_[axis] ? wrapped : period - wrapped;
}

std::vector<std::vector<NodeRun>> OpeningMap::nodes() const {
  std::vector<std::vector<NodeRun>> nodes(openings_.size());
  for (std::size_t n = 0; n < labels_.size(); ++n) {
    if (labels_[n] == none) continue;
    std::vector<NodeRun>& runs = nodes[static_cast<std::size_t>(labels_[n])];
    if (runs.empty() || runs.back().first + runs.back().count != n)
      runs.push_back({.first = static_cast<std::uint32_t>(n)});
    ++runs.back().count;
  }
  return nodes;
}

std::optional<OpeningRow> OpeningMap::row(std::size_t opening, int axis, double position) const {
  const int other = 1 - axis;
  const int cells = frame_.cells[axis];
  const double between = position / frame_.spacing + frame_.middle(other);
  const std::array<int, 2> rows{fold(other, static_cast<int>(std::floor(between + 1e-6))),
                                fold(other, static_cast<int>(std::ceil(between - 1e-6)))};
  const auto node = [&](int index, int row) {
    const int along = fold(axis, index);
    return axis == 0 ? place(along, row) : place(row, along);
  };
  const auto label = [&](int index) {
    const int first = labels_[node(index, rows[0])];
    return first != none ? first : labels_[node(index, rows[1])];
  };
  const auto is_field = [&](int index) {
    return label(index) == none && !is_plugged_[node(index, rows[0])] &&
           !is_plugged_[node(index, rows[1])];
  };
  const auto own = static_cast<int>(opening);
  // The widest of its parts that begin within the domain, or beyond its lower side.
  std::array<int, 2> widest{0, -1};
  for (int start = -cells; start <= cells; ++start) {
    if (label(start) != own || label(start - 1) == own) continue;
    int end = start;
    while (end < start + 2 * cells && label(end + 1) == own) ++end;
    if (end < 0) continue;
    if (end - start > widest[1] - widest[0]) widest = {start, end};
    start = end;
  }
  if (widest[1] < widest[0] || widest[1] - widest[0] >= 2 * cells) return std::nullopt;
  const auto [first, last] = widest;
  int before = first - 1;
  while (is_field(before) && before > first - 2 * cells) --before;
  int after = last + 1;
  while (is_field(after) && after < last + 2 * cells) ++after;
  return OpeningRow{.centre = frame_.node_position(axis, 0.5 * (first + last)),
                    .left_field = frame_.node_position(axis, 0.5 * (before + first)),
                    .right_field = frame_.node_position(axis, 0.5 * (last + after))};
}

double OpeningMap::height_deviation() const {
  const auto count = static_cast<double>(heights_.size());
  double mean = 0;
  for (const double height : heights_) mean += height / count;
  double sum = 0;
  for (const double height : heights_) sum += (height - mean) * (height - mean);
  return std::sqrt(sum / count);
}

}  // namespace scarp
