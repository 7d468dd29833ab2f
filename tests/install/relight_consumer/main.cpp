// An application with relit performances outside the source tree: the component `relight` is installed with all that it
// needs.
#include <array>
#include <cstdlib>
#include <iostream>

#include <lightwell/probe.hpp>
#include <lightwell/relight.hpp>
#include <lightwell/relight_align.hpp>
#include <lightwell/relight_capture.hpp>
#include <lightwell/relight_stream.hpp>

int main() {
  using namespace lightwell;
  const RelightCamera camera{2, 2, 2, 1, 1, {}};
  const std::array<float, 4> depth = {1, 1, 1, 1};
  const auto subject = RelightSubject::from_depth(camera, depth, {});
  if (!subject.ok()) return EXIT_FAILURE;
  const std::array<BasisLight, 1> basis{};
  const std::array<RgbFactor, 1> weights = {RgbFactor{1, 1, 1}};
  AlphaMaps alpha;
  if (!alpha.compute(*subject, basis, {}, weights).ok()) return EXIT_FAILURE;
  if (!simulate_indirect(*subject, basis, {}, alpha).ok()) return EXIT_FAILURE;
  if (!refine_depth(*subject, subject->normals()).ok()) return EXIT_FAILURE;
  std::vector<std::vector<Radiance>> aligned;
  if (align_photographs(0, 0, {}, {}, {}, aligned).ok()) return EXIT_FAILURE;
  if (BasisReader::open("absent").ok()) return EXIT_FAILURE;
  std::cout << "lightwell " << version() << '\n';
  return EXIT_SUCCESS;
}
