#include "levelset/vdb.h"

template class openvdb::Grid<openvdb::FloatTree>;
template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;

namespace scarp {

void initialize_openvdb() { openvdb::initialize(); }

}  // namespace scarp
