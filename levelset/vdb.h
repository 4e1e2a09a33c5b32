#pragma once

// The only header that includes OpenVDB: it takes seconds to compile, so few source files see it.
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include "levelset/band.h"

// The float grid is compiled once, in vdb.cpp.
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;

namespace scarp {

using PhiGrid = openvdb::FloatGrid;
using PhiTree = openvdb::FloatTree;

/// OpenVDB registers its types once per process.
void initialize_openvdb();

/// The grid behind a band.
struct Band::Storage {
  Storage() {
    initialize_openvdb();
    grid = PhiGrid::create(LevelSet::half_width);
  }
  explicit Storage(PhiGrid::Ptr existing) : grid(std::move(existing)) {}

  PhiGrid::Ptr grid;
};

}  // namespace scarp
