#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/scarp/commands.h"
#include "core/error.h"
#include "models/registry.h"

namespace scarp {

namespace {

nlohmann::ordered_json as_json(const ModelDescription& model) {
  nlohmann::ordered_json parameters = nlohmann::ordered_json::array();
  for (const Parameter& parameter : model.parameters) {
    parameters.push_back({{"name", parameter.name},
                          {"unit", unit_text(parameter)},
                          {"default", default_text(parameter)},
                          {"range", range_text(parameter)},
                          {"by_material", is_by_material(parameter)},
                          {"meaning", parameter.meaning},
                          {"source", parameter.source}});
  }
  return {{"name", model.name},       {"summary", model.summary}, {"equation", model.equation},
          {"symbols", model.symbols}, {"limits", model.limits},   {"source", model.source},
          {"parameters", parameters}};
}

const ModelDescription& model_named(const std::string& name) {
  const ModelDescription* model = find_model(name);
  if (model == nullptr) throw InputError(unknown_model_text(name));
  return *model;
}

}  // namespace

ExitCode execute(const ModelsArguments& arguments, const CommonOptions& common) {
  const std::string& name = arguments.name;
  if (!common.json) {
    std::cout << (name.empty() ? model_pages() : model_page(model_named(name)));
    return done;
  }
  nlohmann::ordered_json result;
  if (name.empty()) {
    for (const ModelDescription& model : models()) result[model.name] = as_json(model);
  } else {
    result = as_json(model_named(name));
  }
  std::cout << result.dump(2) << '\n';
  return done;
}

}  // namespace scarp
