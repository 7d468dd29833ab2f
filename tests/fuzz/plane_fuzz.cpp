// A PlaneReader on any messages, with intact ones among them: nothing it answers is out of range, and a reader of the
// intact ones alone is complete.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include <lightwell/plane_appearance.hpp>
#include <lightwell/plane_codec.hpp>
#include <lightwell/plane_guidance.hpp>

#include "support/captured_planes.hpp"

namespace {

using namespace lightwell;

void require(bool holds) {
  if (!holds) std::abort();
}

bool finite(const Radiance& v) { return std::isfinite(v.r + v.g + v.b); }

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::span rest = std::as_bytes(std::span(data, size));
  PlaneEncoder encoder({.images = ImageRecipients::all_clients});
  PlaneReader reader, intact;
  CapturedPlane plane = test::linear_plane(40, 4, 3);
  std::vector<float> rgb(3 * 8 * 8);
  // The first byte: after how many pieces of the input an intact message follows. A piece: two bytes of length.
  const std::size_t period = rest.empty() ? 1 : 1 + std::to_integer<std::size_t>(rest.front()) % 4;
  if (!rest.empty()) rest = rest.subspan(1);
  for (std::size_t k = 0; rest.size() > 2; ++k) {
    const std::size_t length = std::to_integer<std::size_t>(rest[0]) | std::to_integer<std::size_t>(rest[1]) << 8U;
    rest = rest.subspan(2);
    const std::size_t piece = std::min(rest.size(), length);
    (void)reader.take(rest.first(piece), {1000});
    rest = rest.subspan(piece);
    if (k % period == 0) {
      plane.info.mid_exposure.ns += 4'000'000'000;
      plane.texture.radiance[k % plane.texture.count()] = {1, 2, 3};
      const auto messages = encoder.encode(plane, plane.info.mid_exposure);
      require(messages.ok());
      for (const auto& m : *messages) {
        (void)reader.take(m, {1000});
        require(intact.take(m, {1000}).ok());
      }
      require(intact.complete());
    }
    const PlaneAppearance now = reader.snapshot({2000});
    const double half = now.info().size_m / 2;
    require(finite(now.radiance({0.3 * half, -0.7 * half}, {half, 0, 2 * half}).value));
    require(finite(now.specular({1, 2, 0.1}).value));
    (void)now.render({8, 8, 9, 9, 4, 4, {{}, {0, 0, 2 * half}}}, PlaneLayers::all, rgb);
    for (const float v : rgb) require(std::isfinite(v));
    const PlaneGuidance guidance = now.guidance();
    require(guidance.seen >= 0 && guidance.seen <= 1 + 1e-9);
  }
  return 0;
}
