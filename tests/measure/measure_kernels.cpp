// Deviation of coefficients computed by the float and integer kernels from the reference in double: one JSON object per
// line for tests/figures, for every vector unit of this machine and every pixel format. Also runs under qemu-user.
//   float_vs_double.<target>.<format>           the pass that the estimator uses for one exposure of this format
//   float_vs_double.<target>.<format>_bracket   three exposures merged pixel by pixel (BlockPass)
// The value is the largest deviation of a coefficient relative to the largest coefficient, over all cases.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>

#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/code_pass.hpp"
#include "firmware/estimate/each_target.hpp"
#include "firmware/estimate/oracle_cases.hpp"
#include "measure/output.hpp"

namespace {

using namespace lightwell;
using test::Curve;

struct Rig {
  const char* kind;
  int width, height;
  int edge;
};
/// Image sizes with the block sizes that the estimator uses for them at `balanced` and `fast`.
constexpr Rig kRigs[] = {{"pair", 320, 240, 2},     {"pair", 320, 240, 4},     {"single", 320, 240, 4},
                         {"equirect", 512, 256, 4}, {"equirect", 512, 256, 8}, {"double_sphere", 320, 240, 4}};
constexpr unsigned kSeeds[] = {1, 2};

/// Worst deviation by figure.
std::map<std::string, double> worst;

void compare(test::OracleCase& c, const Rig& rig, const reference::RandomScene& scene,
             std::span<const double> exposures, double fill, const char* suffix) {
  const test::Shot shot = c.shoot(scene, exposures, fill);
  const estimate::BlockLayout& layout = c.layout(rig.edge);
  const estimate::CellGrid& grid = c.grid(rig.edge);
  estimate::RowReader reader(c.rig(), c.table());
  estimate::BlockPass pixels(c.table(), layout);
  estimate::CodePass codes(c.rig(), c.table(), layout);
  if (!reader.bind(shot.frames).ok()) std::abort();
  const auto truth = c.coefficients(c.truth(shot.frames, rig.edge), rig.edge);
  test::on_each_target([&](const char* target) {
    estimate::BlockSums sums(layout);
    if (codes.supports(shot.frames))
      codes.run(shot.frames[0], {}, {}, sums);
    else
      pixels.run(reader, sums);
    estimate::Projection p;
    grid.project(sums.sum, {}, p);
    double& value = worst[std::string(target) + "." + std::string(to_string(c.format())) + suffix];
    value = std::max(value, test::deviation(p, truth));
  });
}

}  // namespace

int main() {
  const double one[] = {1}, three[] = {8, 1, 0.15};
  for (const PixelFormat format : kPixelFormats) {
    for (const Rig& rig : kRigs) {
      test::OracleCase c(rig.kind, rig.width, rig.height, format, Curve::as_it_comes);
      for (const unsigned seed : kSeeds) {
        const reference::RandomScene scene(seed);
        compare(c, rig, scene, one, 0.95, "");
        compare(c, rig, scene, three, 1.5, "_bracket");
      }
    }
  }
  for (const auto& [figure, value] : worst) measure::print_figure("float_vs_double." + figure, value);
  return 0;
}
