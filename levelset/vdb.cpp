#include "levelset/vdb.h"

namespace scarp {

void initialize_openvdb() { openvdb::initialize(); }

}  // namespace scarp
