#include "levelset/metrology/opening_names.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scarp {

namespace {

// The part of its nodes that makes an opening the same one, whatever else it shares some with.
constexpr double nearly_all = 0.9;

// How far an opening may have moved from where it was, where it has no node in common with that.
// Units: spacings.
constexpr int nearness = 2;

/// How many nodes an opening shares with another one.
struct Share {
  std::size_t other = 0;
  std::size_t nodes = 0;
};
using Shares = std::vector<Share>;

void add_to(Shares& shares, std::size_t other, std::size_t nodes = 1) {
  const auto same = std::ranges::find(shares, other, &Share::other);
  if (same == shares.end()) {
    shares.push_back({other, nodes});
  } else {
    same->nodes += nodes;
  }
}

/// The openings that count: one alone if it has nearly all nodes. Ascending.
std::vector<std::size_t> main_of(const Shares& shares) {
  std::size_t sum = 0;
  for (const Share& each : shares) sum += each.nodes;
  std::vector<std::size_t> others;
  for (const Share& each : shares) {
    if (static_cast<double>(each.nodes) >= nearly_all * static_cast<double>(sum))
      return {each.other};
    others.push_back(each.other);
  }
  std::ranges::sort(others);
  return others;
}

double count_of(std::span<const NodeRun> runs) {
  double count = 0;
  for (const NodeRun& run : runs) count += run.count;
  return count;
}

/// Calls visit(node) for each node of runs. Runs from a damaged file may go beyond the last one.
template <class Visit>
void for_each_node(std::span<const NodeRun> runs, std::size_t node_count, const Visit& visit) {
  for (const NodeRun& run : runs) {
    const std::size_t end = std::min(std::size_t{run.first} + run.count, node_count);
    for (std::size_t n = run.first; n < end; ++n) visit(n);
  }
}

/// Finds the numbers of the openings of one surface.
class Naming {
 public:
  Naming(std::vector<NamedOpening>& known, const OpeningMap& map)
      : known_(known),
        map_(map),
        nodes_(map.nodes()),
        numbers_(nodes_.size()),
        wholes_(nodes_.size()) {
    for (const NamedOpening& each : known_) shares_.push_back(shares_with(each.nodes));
    sources_ = sources();
  }

  std::vector<std::size_t> run() {
    go_on();
    put_together();
    go_near();
    come_back();
    begin();
    return remember();
  }

 private:
  /// An opening that may have a number.
  struct Candidate {
    double likeness = 0;
    std::size_t number = 0;
    std::size_t found = 0;
  };

  Shares shares_with(std::span<const NodeRun> runs) const {
    Shares shares;
    for_each_node(runs, map_.labels().size(), [&](std::size_t n) {
      const int label = map_.labels()[n];
      if (label != OpeningMap::none) add_to(shares, static_cast<std::size_t>(label));
    });
    return shares;
  }

  /// With all nodes that lie near.
  Shares shares_near(std::span<const NodeRun> runs) const {
    Shares shares;
    const auto width = static_cast<std::size_t>(map_.node_counts()[1]);
    for_each_node(runs, map_.labels().size(), [&](std::size_t n) {
      for (int di = -nearness; di <= nearness; ++di) {
        for (int dj = -nearness; dj <= nearness; ++dj) {
          const int label =
              map_.label(static_cast<int>(n / width) + di, static_cast<int>(n % width) + dj);
          if (label != OpeningMap::none) add_to(shares, static_cast<std::size_t>(label));
        }
      }
    });
    return shares;
  }

  /// Of each opening that is found what it was.
  std::vector<std::vector<std::size_t>> sources() const {
    std::vector<Shares> shares(numbers_.size());
    for (std::size_t k = 0; k < known_.size(); ++k) {
      if (!known_[k].is_there) continue;
      for (const Share& each : shares_[k]) add_to(shares[each.other], k, each.nodes);
    }
    std::vector<std::vector<std::size_t>> found;
    for (const Shares& each : shares) found.push_back(main_of(each));
    return found;
  }

  bool is_free(std::size_t number) const {
    return std::ranges::find(numbers_, number) == numbers_.end();
  }

  /// Free, and of an opening that was not there.
  bool may_come_back(std::size_t number) const {
    return !known_[number].is_there && is_free(number);
  }

  void go_on() {
    for (std::size_t k = 0; k < known_.size(); ++k) {
      if (!known_[k].is_there) continue;
      const std::vector<std::size_t> pieces = main_of(shares_[k]);
      std::vector<std::size_t> own;
      for (const std::size_t piece : pieces)
        if (sources_[piece] == std::vector{k}) own.push_back(piece);
      if (pieces.size() > 1) {
        take_apart(k, own);
      } else if (!own.empty()) {
        numbers_[own.front()] = k;
      }
    }
  }

  // Into the parts that it was before, if these are they.
  void take_apart(std::size_t whole, const std::vector<std::size_t>& pieces) {
    std::vector<std::size_t> parts;
    for (const std::size_t piece : pieces) {
      const auto same = std::ranges::find_if(known_[whole].parts, [&](std::size_t part) {
        return may_come_back(part) && main_of(shares_[part]) == std::vector{piece};
      });
      if (same != known_[whole].parts.end()) parts.push_back(*same);
    }
    if (parts.size() == pieces.size() && parts.size() == known_[whole].parts.size()) {
      for (std::size_t n = 0; n < pieces.size(); ++n) numbers_[pieces[n]] = parts[n];
      return;
    }
    known_[whole].parts.clear();
    for (const std::size_t piece : pieces) wholes_[piece] = whole;
  }

  // What has merged in the same way before.
  void put_together() {
    for (std::size_t f = 0; f < numbers_.size(); ++f) {
      if (sources_[f].size() < 2) continue;
      const auto same = std::ranges::find(known_, sources_[f], &NamedOpening::parts);
      const auto number = static_cast<std::size_t>(same - known_.begin());
      if (same != known_.end() && may_come_back(number)) numbers_[f] = number;
    }
  }

  // Those that lie beside what is nowhere else.
  void go_near() {
    std::vector<Candidate> candidates;
    for (std::size_t k = 0; k < known_.size(); ++k) {
      if (!known_[k].is_there || !shares_[k].empty()) continue;
      for (const Share& each : shares_near(known_[k].nodes))
        if (sources_[each.other].empty())
          candidates.push_back({static_cast<double>(each.nodes), k, each.other});
    }
    assign(std::move(candidates));
  }

  // Those that lie where one was that has been gone for a while.
  void come_back() {
    std::vector<Candidate> candidates;
    for (std::size_t k = 0; k < known_.size(); ++k) {
      if (known_[k].is_there) continue;
      for (const auto& [found, nodes] : shares_[k]) {
        if (sources_[found].size() > 1 || wholes_[found]) continue;
        const auto both = static_cast<double>(nodes);
        const double either = count_of(known_[k].nodes) + count_of(nodes_[found]) - both;
        candidates.push_back({both / either, k, found});
      }
    }
    assign(std::move(candidates));
  }

  void assign(std::vector<Candidate> candidates) {
    std::ranges::stable_sort(candidates, std::ranges::greater{}, &Candidate::likeness);
    for (const Candidate& each : candidates)
      if (!numbers_[each.found] && is_free(each.number)) numbers_[each.found] = each.number;
  }

  void begin() {
    for (std::size_t f = 0; f < numbers_.size(); ++f) {
      if (numbers_[f]) continue;
      numbers_[f] = known_.size();
      known_.push_back({.place = map_.openings()[f].centre});
      if (sources_[f].size() > 1) known_.back().parts = sources_[f];
      if (wholes_[f]) known_[*wholes_[f]].parts.push_back(*numbers_[f]);
    }
  }

  std::vector<std::size_t> remember() {
    for (NamedOpening& each : known_) each.is_there = false;
    std::vector<std::size_t> numbers;
    for (std::size_t f = 0; f < numbers_.size(); ++f) {
      NamedOpening& opening = known_[*numbers_[f]];
      const std::array<double, 2>& centre = map_.openings()[f].centre;
      const std::array<bool, 2>& through = map_.openings()[f].through;
      for (int axis = 0; axis < 2; ++axis) {
        opening.place[axis] =
            through[axis] ? centre[axis]
                          : copy_near(map_.frame(), axis, centre[axis], opening.place[axis]);
      }
      opening.is_there = true;
      opening.nodes = std::move(nodes_[f]);
      numbers.push_back(*numbers_[f]);
    }
    return numbers;
  }

  std::vector<NamedOpening>& known_;
  const OpeningMap& map_;
  std::vector<std::vector<NodeRun>> nodes_;          ///< of each that is found
  std::vector<Shares> shares_;                       ///< of each number with what is found
  std::vector<std::vector<std::size_t>> sources_;    ///< numbers, of each that is found
  std::vector<std::optional<std::size_t>> numbers_;  ///< of each that is found
  std::vector<std::optional<std::size_t>> wholes_;   ///< of which it is a new part
};

/// Reads what numbers_of() wrote, front to back. Past a number that cannot be there it reads zeros.
class NumberReader {
 public:
  explicit NumberReader(std::span<const double> numbers) : numbers_(numbers) {}

  bool is_at_end() const { return numbers_.empty(); }
  bool is_whole() const { return is_whole_; }

  double next() {
    if (numbers_.empty() || !std::isfinite(numbers_.front())) return fail();
    const double number = numbers_.front();
    numbers_ = numbers_.subspan(1);
    return number;
  }

  std::uint32_t count() {
    const double number = next();
    if (number >= 0 && number <= std::numeric_limits<std::uint32_t>::max())
      return static_cast<std::uint32_t>(number);
    fail();
    return 0;
  }

 private:
  double fail() {
    numbers_ = {};
    is_whole_ = false;
    return 0;
  }

  std::span<const double> numbers_;
  bool is_whole_ = true;
};

NamedOpening read_opening(NumberReader& reader) {
  NamedOpening opening;
  opening.place = {reader.next(), reader.next()};
  opening.is_there = reader.next() != 0;
  for (auto left = reader.count(); left > 0 && reader.is_whole(); --left)
    opening.parts.push_back(reader.count());
  for (auto left = reader.count(); left > 0 && reader.is_whole(); --left) {
    const std::uint32_t first = reader.count();
    opening.nodes.push_back({.first = first, .count = reader.count()});
  }
  return opening;
}

}  // namespace

// For each opening its place, whether it is there, and two lists, each behind its length: parts;
// runs of nodes as pairs.
std::vector<double> numbers_of(const OpeningNames& names) {
  std::vector<double> numbers;
  for (const NamedOpening& each : names.known()) {
    numbers.insert(numbers.end(), {each.place[0], each.place[1], each.is_there ? 1.0 : 0.0});
    numbers.push_back(static_cast<double>(each.parts.size()));
    for (const std::size_t part : each.parts) numbers.push_back(static_cast<double>(part));
    numbers.push_back(static_cast<double>(each.nodes.size()));
    for (const NodeRun& run : each.nodes) {
      numbers.push_back(run.first);
      numbers.push_back(run.count);
    }
  }
  return numbers;
}

std::optional<OpeningNames> opening_names_of(std::span<const double> numbers) {
  NumberReader reader(numbers);
  std::vector<NamedOpening> openings;
  while (!reader.is_at_end()) openings.push_back(read_opening(reader));
  if (!reader.is_whole()) return std::nullopt;
  for (const NamedOpening& each : openings)
    for (const std::size_t part : each.parts)
      if (part >= openings.size()) return std::nullopt;
  return OpeningNames(std::move(openings));
}

double copy_near(const Frame& frame, int axis, double position, double other) {
  if (frame.boundary[axis] != Boundary::periodic) return position;
  const double width = frame.sides().width(axis);
  return position + width * std::round((other - position) / width);
}

std::vector<std::size_t> OpeningNames::add(const OpeningMap& map) {
  return Naming(known_, map).run();
}

}  // namespace scarp
