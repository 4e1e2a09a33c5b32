#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "flux/options.h"
#include "flux/rays/elements.h"
#include "flux/rays/ray_scene.h"

namespace scarp {

/// Independent sets of rays from every element.
inline constexpr std::size_t set_count = 2;

/// How many rays leave each element, in each of its sets.
///
/// Elements are taken along a space-filling curve, one main direction after the other, floors and
/// tops by height, so that neighbours on the surface are neighbours in the list; an element's place
/// in it is its rank. Elements in a row are blocks, which share out the points of one sequence:
/// rays of neighbours fill each other's gaps. From blocks that hardly see the sky some rays are
/// aimed at it.
class RayPlan {
 public:
  /// Every so many rays of a block that aims at the sky one does.
  static constexpr std::uint32_t rays_per_skyward = 4;

  /// least_set: rays in each set of an element, 2 or 4; twice of it where facets are joined.
  /// least_group: elements that are kept apart from others at another height, if there are as many.
  RayPlan(const RayScene& scene, const Elements& elements, std::uint32_t least_set = 2,
          std::size_t least_group = 1);
  RayPlan(const RayPlan&) = delete;
  RayPlan& operator=(const RayPlan&) = delete;

  /// From now on as many rays per share, where a share is an area, or of rings a length of the
  /// section, times the density that the rays of a window's elements are to have.
  ///
  /// Shape: one per window, > 0.
  void weigh(std::span<const double> densities);

  /// As many rays per share everywhere: at first per area, since errors are judged on patches of
  /// the same area, or, of rings, per length of the section, since patches are as wide everywhere.
  /// Even numbers, from 8 in a set on multiples of 4, everywhere multiples of rays_per_skyward
  /// where they aim at the sky, mixed from block to block for the right mean (powers of two make
  /// better sets, but a mixture of two of them has 3 to 8 % more error than as many rays in sets of
  /// nearly one size). Never fewer on any element than before, and together at most cap unless the
  /// least sets of all elements are more.
  void grow(double rays_per_share, std::uint64_t cap);

  const Elements& elements() const { return *elements_; }
  /// What rays are shared out by: the area of an element; of a ring its width, but for a factor.
  double share_of(std::size_t element) const { return share_[element]; }
  /// The shares of all elements.
  double surface() const { return surface_; }
  std::size_t size() const { return element_at_.size(); }
  std::uint32_t element_at(std::size_t rank) const { return element_at_[rank]; }
  std::uint32_t rank_of(std::size_t element) const { return rank_of_[element]; }
  /// Of the element in which a point of a facet lies.
  std::uint32_t rank_at(std::uint32_t facet, Vec3d r) const {
    const std::uint32_t rank = rank_of_facet_[facet];
    return rank != is_cut ? rank : rank_of_[elements_->element_of(elements_->piece_at(facet, r))];
  }
  std::uint32_t rays(std::size_t rank) const { return rays_[rank]; }
  /// Elements in a row with the same main direction.
  struct Block {
    std::uint32_t begin = 0;  ///< first rank
    std::uint32_t end = 0;
    int main_direction = 0;
    bool aims_at_sky = false;
    std::uint32_t size() const { return end - begin; }
  };
  /// Some blocks in a row, together about 64 elements with the same main direction.
  using Window = std::span<const Block>;
  std::span<const Window> windows() const { return windows_; }
  const Block& block_of(std::size_t rank) const { return blocks_[block_of_[rank]]; }
  /// Before any rays are planned.
  void aim_at_sky(const Window& window);
  /// Which point of its block's sequence for its kind and set a ray takes. It is the same however
  /// many rays there are.
  struct Place {
    std::size_t share = 0;
    std::uint32_t index = 0;  ///< in the share
    bool is_skyward = false;
  };
  Place place(std::size_t rank, std::uint32_t index) const;
  /// Number of rays in one set of all ranks before this one.
  std::uint64_t first(std::size_t rank) const { return first_[rank]; }
  /// The rays of the least sets of all elements.
  std::uint64_t least_total() const;
  /// Whether no element sends more, however many are asked for.
  bool is_full() const;
  std::uint64_t total() const { return first_.back() * set_count; }
  /// Number of rays in one set of all ranks before each, and of all.
  std::span<const std::uint64_t> first() const { return first_; }

 private:
  static constexpr std::uint32_t is_cut = ~std::uint32_t{0};

  void share_by_width();
  // Elements that blocks do not reach beyond.
  struct Row {
    std::uint32_t begin = 0;  // first rank
    std::uint32_t end = 0;
    int main_direction = 0;
    std::uint32_t size() const { return end - begin; }
  };
  std::vector<Row> rows(const RayScene& scene, std::span<const std::uint32_t> groups) const;
  void make_blocks(const RayScene& scene, std::span<const std::uint32_t> groups);
  bool is_parted(std::uint32_t rank) const;
  std::uint32_t least(std::size_t rank) const;
  std::uint32_t step(std::size_t rank, double of_set) const;
  std::vector<std::uint32_t> wanted(double rays_per_share) const;

  const Elements* elements_;
  std::uint32_t least_set_;
  std::vector<double> share_;
  double surface_ = 0;
  std::vector<std::uint32_t> element_at_;
  std::vector<std::uint32_t> rank_of_;
  std::vector<std::uint32_t> rank_of_facet_;  // is_cut where it has several
  std::vector<Block> blocks_;
  std::vector<Window> windows_;
  std::vector<std::uint32_t> block_of_;  // per rank
  std::vector<std::uint32_t> rays_;
  std::vector<std::uint64_t> first_;
};

/// Where half differences alone tell how large errors are, fewer elements that are alike tell too
/// little.
inline constexpr std::size_t least_group_of_halves = 8;

/// What is sent in all at least, memory permitting. The two sets of a few rays often find the same,
/// which is no sign of a small error.
inline constexpr std::uint64_t least_rays = 4096;

struct RayLimit {
  std::uint64_t rays = 0;
  RayCap cap = RayCap::rays;  ///< whose it is
};

/// The most rays that a memory limit and the options allow. Throws: InputError if they are fewer
/// than the least sets take.
RayLimit ray_limit(const FluxOptions& options, std::uint64_t least, std::size_t bytes_per_ray);

}  // namespace scarp
