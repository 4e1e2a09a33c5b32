#include "levelset/grid/vdb.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <stdexcept>

namespace scarp {

namespace {

using Grid = openvdb::FloatGrid;

openvdb::Coord coord(const Node& node) { return {node[0], node[1], node[2]}; }

Leaf leaf_of(Grid::TreeType::LeafNodeType& leaf) {
  const openvdb::Coord origin = leaf.origin();
  return {.origin = {origin.x(), origin.y(), origin.z()},
          .phi = leaf.buffer().data(),
          .active = &leaf.getValueMask().getWord<std::uint64_t>(0)};
}

void insert(openvdb::MetaMap& meta, const VdbMetadata& values) {
  for (const auto& entry : values) {
    std::visit(
        [&](const auto& value) {
          using Value = std::decay_t<decltype(value)>;
          meta.insertMeta(entry.first, openvdb::TypedMetadata<Value>(value));
        },
        entry.second);
  }
}

/// Takes a value over if it is of the given type.
template <class Value>
void take(const openvdb::Metadata& meta, const std::string& name, VdbMetadata& values) {
  if (meta.typeName() == openvdb::TypedMetadata<Value>::staticTypeName()) {
    values[name] = static_cast<const openvdb::TypedMetadata<Value>&>(meta).value();
  }
}

VdbMetadata values_of(const openvdb::MetaMap& meta) {
  VdbMetadata values;
  for (auto entry = meta.beginMeta(); entry != meta.endMeta(); ++entry) {
    const auto& [name, value] = *entry;
    take<bool>(*value, name, values);
    take<std::int32_t>(*value, name, values);
    take<std::int64_t>(*value, name, values);
    take<double>(*value, name, values);
    take<std::string>(*value, name, values);
  }
  return values;
}

}  // namespace

struct VdbGrid::Storage {
  Grid::Ptr grid;
};

VdbGrid::VdbGrid() {
  openvdb::initialize();
  storage_ = std::make_unique<Storage>(Storage{Grid::create(LevelSet::half_width)});
}

VdbGrid::VdbGrid(Storage storage) : storage_(std::make_unique<Storage>(std::move(storage))) {}

VdbGrid::~VdbGrid() = default;

std::shared_ptr<VdbGrid> VdbGrid::copy() const {
  return std::shared_ptr<VdbGrid>(new VdbGrid(Storage{storage_->grid->deepCopy()}));
}

std::vector<Leaf> VdbGrid::leaves() {
  std::vector<Leaf> all;
  for (auto leaf = storage_->grid->tree().beginLeaf(); leaf; ++leaf) {
    all.push_back(leaf_of(*leaf));
  }
  return all;
}

Leaf VdbGrid::add_leaf(const NewLeaf& leaf) {
  auto* made = storage_->grid->tree().touchLeaf(coord(leaf.origin));
  made->fill(leaf.solid ? -LevelSet::half_width : LevelSet::half_width, false);
  return leaf_of(*made);
}

void VdbGrid::drop_leaf(const Node& origin) {
  storage_->grid->tree().addTile(1, coord(origin), LevelSet::half_width, false);
}

std::size_t VdbGrid::memory_bytes() const { return storage_->grid->memUsage(); }

void VdbFile::write(std::ostream& out) const {
  openvdb::GridPtrVec named;
  for (const VdbEntry& entry : grids) {
    const Grid::Ptr grid = entry.grid->storage_->grid->copy();  // the tree is shared
    const auto transform = openvdb::math::Transform::createLinearTransform(entry.spacing);
    transform->postTranslate({entry.origin.x, entry.origin.y, entry.origin.z});
    grid->setTransform(transform);
    grid->setName(entry.name);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    insert(*grid, entry.metadata);
    named.push_back(grid);
  }
  openvdb::MetaMap meta;
  insert(meta, metadata);
  openvdb::io::Stream stream(out);
  stream.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK);
  stream.write(named, meta);
}

VdbFile VdbFile::read(std::istream& in) {
  openvdb::initialize();
  openvdb::io::Stream stream(in, /*delayLoad=*/false);
  VdbFile file;
  if (const auto meta = stream.getMetadata()) file.metadata = values_of(*meta);
  for (const auto& base : *stream.getGrids()) {
    const auto grid = openvdb::gridPtrCast<Grid>(base);
    if (!grid) throw std::runtime_error("a grid is not of floats");
    file.grids.push_back({.name = grid->getName(),
                          .origin = {},
                          .metadata = values_of(*grid),
                          .grid = std::shared_ptr<VdbGrid>(new VdbGrid(VdbGrid::Storage{grid}))});
  }
  return file;
}

}  // namespace scarp
