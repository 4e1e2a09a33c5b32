#pragma once

// What scarp takes from OpenVDB: the tree that holds the leaves of a band, and its files. Only
// vdb.cpp sees OpenVDB, whose headers take seconds to compile.

#include <cstdint>
#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/vec3.h"
#include "levelset/grid/band.h"

namespace scarp {

/// An OpenVDB tree of float leaves. Its background is LevelSet::half_width.
class VdbGrid {
 public:
  VdbGrid();
  ~VdbGrid();
  VdbGrid(const VdbGrid&) = delete;
  VdbGrid& operator=(const VdbGrid&) = delete;

  std::shared_ptr<VdbGrid> copy() const;

  /// All leaves, in the order of the tree. They stay where they are until they are dropped.
  std::vector<Leaf> leaves();

  /// Makes a leaf without active nodes.
  Leaf add_leaf(const NewLeaf& leaf);
  void drop_leaf(const Node& origin);

  std::size_t memory_bytes() const;

 private:
  struct Storage;
  explicit VdbGrid(Storage storage);
  std::unique_ptr<Storage> storage_;

  friend struct VdbFile;
};

/// Values by name.
using VdbMetadata =
    std::map<std::string, std::variant<bool, std::int32_t, std::int64_t, double, std::string>>;

/// A grid of a file with its name and its place in space.
struct VdbEntry {
  std::string name;
  double spacing = 1;
  Vec3d origin;  ///< of the node 0, 0, 0
  VdbMetadata metadata;
  std::shared_ptr<VdbGrid> grid;
};

/// The content of a .vdb file: other programs read the grids as level sets.
struct VdbFile {
  VdbMetadata metadata;
  std::vector<VdbEntry> grids;

  void write(std::ostream& out) const;

  /// Spacings and origins are not read. Metadata of other types are left out.
  /// Throws a std::exception if the content is damaged or a grid is not of float leaves.
  static VdbFile read(std::istream& in);
};

}  // namespace scarp
