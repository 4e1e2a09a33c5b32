// A public header: installed as scarp/levelset/grid/level_set.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "core/frame.h"
#include "core/vec3.h"

namespace scarp {

class Band;

/// A surface as the zero of a signed distance phi, kept in a narrow band of grid nodes.
///
/// phi < 0 in the solid. Nodes with |phi| < half_width are active; every other node has phi =
/// +-half_width. No node has phi = 0 exactly. Laterally only nodes of the domain are stored: what
/// lies beyond a side is mirrored or wrapped when it is read.
///
/// Units: phi at nodes in grid spacings, everything else in nm.
class LevelSet {
 public:
  static constexpr float half_width = 4.0F;

  /// phi from a signed distance that is evaluated at nodes between the heights lower and upper.
  ///
  /// The zero of distance must lie between them by half_width spacings. Away from it distance may
  /// be too large by the given factor. It is called from several threads.
  LevelSet(const Frame& frame, const std::function<double(Vec3d)>& distance, double lower,
           double upper, double overestimate = 1);

  explicit LevelSet(std::unique_ptr<Band> band);
  LevelSet(LevelSet&&) noexcept;
  LevelSet& operator=(LevelSet&&) noexcept;
  LevelSet(const LevelSet&) = delete;
  LevelSet& operator=(const LevelSet&) = delete;
  ~LevelSet();

  LevelSet copy() const;

  const Frame& frame() const;

  /// phi at a node in grid spacings; i and j may lie beyond the sides.
  float node(int i, int j, int k) const;

  /// Signed distance at any point, interpolated linearly between nodes; +-half_width spacings away
  /// from the band. Units: nm.
  double distance(Vec3d r) const;

  /// Unit vector along grad phi at a point, by central differences; zero where phi is constant.
  Vec3d normal(Vec3d r) const;

  bool empty() const;
  std::size_t active_count() const;
  std::size_t memory_bytes() const;

  /// Heights between which the leaves of the band lie. Units: nm.
  double lower() const;
  double upper() const;

  /// Of phi and of the band's topology; the same on every machine.
  std::uint64_t hash() const;

  /// For the other files of this folder.
  Band& band() { return *band_; }
  const Band& band() const { return *band_; }

 private:
  std::unique_ptr<Band> band_;
};

}  // namespace scarp
