#include "flux/rays/ray_plan.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>

#include "core/error.h"
#include "flux/rays/spatial_order.h"
#include "flux/sampling/sobol.h"

namespace scarp {

namespace {

constexpr std::uint32_t most_in_set = 1U << 15;

// One element for each share. Blocks of 8 and of 32 have larger errors.
constexpr std::uint32_t longest_block = share_count;

// What the elements of a row share is known by the differences between its blocks, so a short row
// has several. Those of a cross-section are few; shares of powers of two fill each other's gaps
// best. With blocks of 16 the floors of trenches and holes err by half again what they state.
// With four in a section errors of a pair of elements that see each other alone, as in a recess,
// blow up; rings have four, since neighbours among them see nearly the same.
constexpr std::uint32_t blocks_in_row = 4;
constexpr std::uint32_t blocks_in_row_of_section = 2;
constexpr std::uint32_t shortest_block = 2;

constexpr std::uint32_t elements_in_window = 64;

int main_direction_of(const RayScene& scene, const Elements& elements, std::uint32_t element) {
  return main_direction(scene.normal(elements.piece(elements.pieces_of(element).front()).facet));
}

// Elements of the same main direction, and of the floors and tops among them those of the same
// height: what sees only the sky has nothing in common with what lies at the bottom of a hole.
std::vector<std::uint32_t> groups_of(const RayScene& scene, const Elements& elements,
                                     std::size_t least) {
  constexpr double gap = 4;  // spacings, between two heights
  constexpr int upward = 4;  // the first of two main directions
  std::vector<std::uint32_t> order(elements.count());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<int> directions;
  for (const std::uint32_t e : order) directions.push_back(main_direction_of(scene, elements, e));
  const auto height = [&](std::uint32_t e) {
    return directions[e] < upward ? 0 : elements.middle(e).z;
  };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tuple(directions[a], height(a), a) < std::tuple(directions[b], height(b), b);
  });
  std::vector<std::uint32_t> groups(order.size());
  std::size_t first = 0;  // of the group
  for (std::size_t k = 1; k < order.size(); ++k) {
    const std::uint32_t before = order[k - 1];
    const bool turns = directions[order[k]] != directions[before];
    const bool rises = height(order[k]) - height(before) > gap && k - first >= least;
    if (turns || rises) first = k;
    groups[order[k]] = groups[before] + (turns || rises ? 1 : 0);
  }
  return groups;
}

}  // namespace

RayPlan::RayPlan(const RayScene& scene, const Elements& elements, std::uint32_t least_set,
                 std::size_t least_group)
    : elements_(&elements), least_set_(least_set) {
  for (std::size_t f = 0; f < scene.facet_count(); ++f) surface_ += scene.area(f);
  for (std::size_t e = 0; e < elements.count(); ++e) share_.push_back(elements.area(e));
  if (elements.are_rings()) share_by_width();
  std::vector<std::uint64_t> keys(elements.count());
  const Vec3d size{scene.upper().x, scene.upper().y, scene.source_height() - scene.lowest()};
  const double largest = std::max({size.x, size.y, size.z});
  for (std::size_t e = 0; e < keys.size(); ++e) {
    const Vec3d r = elements.middle(e);
    keys[e] = curve_key({r.x / largest, r.y / largest, (r.z - scene.lowest()) / largest},
                        main_direction_of(scene, elements, static_cast<std::uint32_t>(e)));
  }
  const std::vector<std::uint32_t> groups = groups_of(scene, elements, least_group);
  element_at_.resize(keys.size());
  std::iota(element_at_.begin(), element_at_.end(), 0U);
  std::sort(element_at_.begin(), element_at_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tuple(groups[a], keys[a], a) < std::tuple(groups[b], keys[b], b);
  });
  rank_of_.resize(keys.size());
  for (std::uint32_t rank = 0; rank < keys.size(); ++rank) rank_of_[element_at_[rank]] = rank;
  rank_of_facet_.resize(scene.facet_count(), is_cut);
  for (std::uint32_t f = 0; f < rank_of_facet_.size(); ++f) {
    const auto pieces = elements.pieces_of_facet(f);
    const std::uint32_t element = elements.element_of(pieces.front());
    if (std::ranges::all_of(pieces, [&](auto p) { return elements.element_of(p) == element; }))
      rank_of_facet_[f] = rank_of_[element];
  }
  make_blocks(scene, groups);
  rays_.resize(keys.size());
  first_.resize(keys.size() + 1);
}

void RayPlan::share_by_width() {
  // What is so close to the axis that rounding moves it there would get all rays. The root of the
  // area of a ring a thousand times as high as wide is 40 times its radius.
  constexpr double least_radius = 0.01;  // by the root of the area
  surface_ = 0;
  for (std::size_t e = 0; e < share_.size(); ++e) {
    if (share_[e] == 0) continue;
    const Vec3d middle = elements_->middle(e);
    const double radius = std::sqrt(middle.x * middle.x + middle.y * middle.y);
    share_[e] /= std::max(radius, least_radius * std::sqrt(share_[e]));
    surface_ += share_[e];
  }
}

// Ranks of the same group.
std::vector<RayPlan::Row> RayPlan::rows(const RayScene& scene,
                                        std::span<const std::uint32_t> groups) const {
  std::vector<Row> rows;
  for (std::uint32_t begin = 0; begin < size(); begin = rows.back().end) {
    const int direction = main_direction_of(scene, *elements_, element_at_[begin]);
    std::uint32_t end = begin + 1;
    while (end < size() && !is_parted(end) &&
           groups[element_at_[end]] == groups[element_at_[begin]])
      ++end;
    rows.push_back({.begin = begin, .end = end, .main_direction = direction});
  }
  return rows;
}

void RayPlan::make_blocks(const RayScene& scene, std::span<const std::uint32_t> groups) {
  const std::vector<Row> rows = this->rows(scene, groups);
  std::vector<std::size_t> first_block;
  block_of_.resize(size());
  for (const Row& row : rows) {
    first_block.push_back(blocks_.size());
    const std::uint32_t blocks = elements_->are_of_section() && !elements_->are_rings()
                                     ? blocks_in_row_of_section
                                     : blocks_in_row;
    const std::uint32_t longest =
        std::clamp(std::bit_floor(row.size() / blocks), shortest_block, longest_block);
    for (std::uint32_t begin = row.begin; begin < row.end; begin = blocks_.back().end) {
      const std::uint32_t end = std::min(begin + longest, row.end);
      std::fill(block_of_.begin() + begin, block_of_.begin() + end,
                static_cast<std::uint32_t>(blocks_.size()));
      blocks_.push_back({.begin = begin, .end = end, .main_direction = row.main_direction});
    }
  }
  first_block.push_back(blocks_.size());
  // What is left of a row lengthens its windows: one block alone would tell its error by one
  // sample.
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const std::size_t blocks = first_block[r + 1] - first_block[r];
    const std::size_t count = std::max(1U, rows[r].size() / elements_in_window);
    for (std::size_t n = 0; n < count; ++n) {
      const std::size_t first = blocks * n / count;
      const std::size_t end = blocks * (n + 1) / count;
      windows_.push_back(std::span(blocks_).subspan(first_block[r] + first, end - first));
    }
  }
}

// Of so few elements the next along the curve may lie elsewhere: the floor of a hole and the wafer
// around it have nothing in common.
bool RayPlan::is_parted(std::uint32_t rank) const {
  constexpr double far = 4;  // spacings
  if (!elements_->are_of_section() || rank == 0) return false;
  return length(elements_->middle(element_at_[rank]) - elements_->middle(element_at_[rank - 1])) >
         far;
}

void RayPlan::weigh(std::span<const double> densities) {
  surface_ = 0;
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    for (std::uint32_t rank = windows_[w].front().begin; rank < windows_[w].back().end; ++rank) {
      share_[element_at_[rank]] *= densities[w];
      surface_ += share_[element_at_[rank]];
    }
  }
}

void RayPlan::aim_at_sky(const Window& window) {
  for (Block& block : std::span(blocks_).subspan(
           static_cast<std::size_t>(window.data() - blocks_.data()), window.size()))
    block.aims_at_sky = true;
}

// Small ones beside an edge are as well known as if their facets were not joined.
std::uint32_t RayPlan::least(std::size_t rank) const {
  const bool is_joined = elements_->pieces_of(element_at_[rank]).size() > 1;
  return std::max(is_joined ? 2 * least_set_ : least_set_, step(rank, 0));
}

std::uint64_t RayPlan::least_total() const {
  std::uint64_t sum = 0;
  for (std::size_t rank = 0; rank < size(); ++rank) sum += least(rank) * set_count;
  return sum;
}

bool RayPlan::is_full() const {
  return std::ranges::all_of(rays_, [](std::uint32_t rays) { return rays >= most_in_set; });
}

// So that as many of every element's rays are aimed at the sky, in every round.
std::uint32_t RayPlan::step(std::size_t rank, double of_set) const {
  constexpr std::uint32_t many = 8;
  constexpr std::uint32_t of_many = 4;
  static_assert(of_many % rays_per_skyward == 0);
  const std::uint32_t of_few = block_of(rank).aims_at_sky ? rays_per_skyward : least_set_;
  return of_set < many ? of_few : of_many;
}

// A fraction of the blocks takes a step more, all of each, or its elements would lack what others
// have; they are spread evenly by the block's bits in reverse.
std::vector<std::uint32_t> RayPlan::wanted(double rays_per_share) const {
  std::vector<std::uint32_t> wanted(size());
  for (std::uint32_t rank = 0; rank < wanted.size(); ++rank) {
    const double of_set = rays_per_share * share_of(element_at_[rank]) / set_count;
    const std::uint32_t of_step = step(rank, of_set);
    const double steps = std::min(of_set, double{most_in_set}) / of_step;
    const double threshold = reverse_bits(block_of_[rank]) * 0x1.0p-32;
    const double whole = std::floor(steps + threshold);
    wanted[rank] =
        std::max({least(rank), rays_[rank], of_step * static_cast<std::uint32_t>(whole)});
  }
  return wanted;
}

void RayPlan::grow(double rays_per_share, std::uint64_t cap) {
  cap = std::max({cap, total(), least_total()});
  std::vector<std::uint32_t> rays = wanted(rays_per_share);
  while (std::accumulate(rays.begin(), rays.end(), std::uint64_t{0}) * set_count > cap) {
    rays_per_share *= 0.95;
    rays = wanted(rays_per_share);
  }
  rays_ = std::move(rays);
  for (std::size_t rank = 0; rank < size(); ++rank) first_[rank + 1] = first_[rank] + rays_[rank];
}

RayPlan::Place RayPlan::place(std::size_t rank, std::uint32_t index) const {
  const Block& block = block_of(rank);
  const std::size_t share = rank - block.begin;
  if (!block.aims_at_sky) return {share, index, false};
  const std::uint32_t skyward = index / rays_per_skyward;  // before this one
  const bool is_skyward = index % rays_per_skyward == rays_per_skyward - 1;
  return {share, is_skyward ? skyward : index - skyward, is_skyward};
}

RayLimit ray_limit(const FluxOptions& options, std::uint64_t least, std::size_t bytes_per_ray) {
  const std::uint64_t fit = options.memory_limit / bytes_per_ray;
  if (fit < least) {
    throw InputError("flux.memory_limit: " + std::to_string(options.memory_limit) +
                     " bytes hold fewer than the " + std::to_string(least) +
                     " rays that all pieces of the surface send at least; allow at least " +
                     std::to_string(least * bytes_per_ray) + " bytes");
  }
  const std::uint64_t asked =
      std::max(least_rays, options.rays > 0 ? options.rays : options.max_rays);
  return fit < asked ? RayLimit{fit, RayCap::memory} : RayLimit{asked, RayCap::rays};
}

}  // namespace scarp
