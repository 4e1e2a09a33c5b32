#include "core/material.h"

#include "core/error.h"

namespace scarp {

Materials::Materials() : materials_{{"Si", 5.0}} {}

bool Materials::contains(std::string_view name) const {
  for (const Material& material : materials_) {
    if (material.name == name) return true;
  }
  return false;
}

MaterialId Materials::id(std::string_view name) const {
  for (std::size_t i = 0; i < materials_.size(); ++i) {
    if (materials_[i].name == name) return static_cast<MaterialId>(i);
  }
  throw InputError("there is no material of the name " + std::string(name));
}

MaterialId Materials::add(Material material) {
  if (contains(material.name)) {
    const MaterialId old = id(material.name);
    materials_[old] = material;
    return old;
  }
  materials_.push_back(material);
  return static_cast<MaterialId>(materials_.size() - 1);
}

}  // namespace scarp
