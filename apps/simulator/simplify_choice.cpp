#include "apps/simulator/simplify_choice.h"

#include <fmt/format.h>

#include "core/recipe/csv_table.h"

namespace scarp {

namespace {

// Below it neither way takes much longer than the other, whatever the step.
constexpr std::size_t few_facets = 1000;

// Beams do: every facet looks for them.
bool traces_rays(const ProcessStep& step) { return step.model && !step.model->species().empty(); }

}  // namespace

SimplifyChoice simplify_choice(const Simplification& simplification, const ProcessStep& step,
                               std::size_t facets_full) {
  if (!simplification.where_it_pays) return SimplifyChoice::simplify;
  if (!traces_rays(step)) return SimplifyChoice::no_rays;
  return facets_full < few_facets ? SimplifyChoice::few_facets : SimplifyChoice::simplify;
}

std::string cell_of(SimplifyChoice choice) {
  switch (choice) {
    case SimplifyChoice::no_rays:
      return "no_rays";
    case SimplifyChoice::few_facets:
      return "few_facets";
    case SimplifyChoice::simplify:
      break;
  }
  return "";
}

std::string reason_of(SimplifyChoice choice) {
  return choice == SimplifyChoice::no_rays
             ? "the step traces no rays"
             : fmt::format("the mesh has fewer than {} facets", few_facets);
}

LeftOutCount left_out_count(const std::filesystem::path& metrics) {
  const CsvTable table(metrics);
  LeftOutCount count{.time_steps = table.row_count()};
  for (std::size_t row = 0; row < table.row_count(); ++row) {
    const std::string cell = table.text(row, "simplify_left_out");
    count.no_rays += cell == cell_of(SimplifyChoice::no_rays) ? 1 : 0;
    count.few_facets += cell == cell_of(SimplifyChoice::few_facets) ? 1 : 0;
  }
  return count;
}

}  // namespace scarp
