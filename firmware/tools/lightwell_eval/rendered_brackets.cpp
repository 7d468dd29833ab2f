#include "tools/lightwell_eval/rendered_brackets.hpp"

#include <algorithm>
#include <cmath>

#include "sim/render.hpp"
#include "sim/rigs.hpp"
#include "sim/sensor.hpp"

namespace lightwell::eval {

std::vector<Frame> RenderedBracket::frames(std::span<const std::byte> memory, std::uint64_t number) const {
  std::vector<Frame> out;
  std::size_t picture = 0;
  for (std::size_t e = 0; e < exposures.size(); ++e) {
    Frame frame;
    frame.info.sequence = number * exposures.size() + e;
    frame.info.mid_exposure = {static_cast<std::int64_t>(number + 1) * 33'000'000 +
                               static_cast<std::int64_t>(e) * 1'000'000};
    frame.info.delivered = frame.info.mid_exposure;
    frame.info.exposure_s = exposures[e];
    frame.info.bracket_index = static_cast<int>(e);
    frame.info.bracket_size = static_cast<int>(exposures.size());
    for (std::size_t k = 0; k < rig.lenses.size(); ++k, ++picture) {
      const LensParameters& lens = rig.lenses[k];
      const std::size_t stride = packed_stride(format, lens.width);
      frame.add_view({static_cast<int>(k), format, lens.width, lens.height, stride,
                      memory.subspan(offsets[picture], picture_bytes(format, stride, lens.height))});
    }
    out.push_back(std::move(frame));
  }
  return out;
}

Result<CameraRenderer> CameraRenderer::make(const sim::Scene& scene, int width, int height) {
  const Result<RigParameters> rig = sim::make_rig("pair", width, height, PixelFormat::rgb_f32);
  if (!rig) return rig.status();
  CameraRenderer out;
  out.width_ = width;
  out.height_ = height;
  const sim::SceneState state = scene.state_at(0);
  const sim::Panorama& panorama = scene.panorama(state);
  out.bright_ = sim::luminance_percentile(panorama, 0.99);
  for (const float v : panorama.rgb) out.peak_ = std::max(out.peak_, static_cast<double>(v));
  for (const LensParameters& lens : rig->lenses)
    out.radiance_.push_back(sim::render_radiance(scene, state, lens, sim::samples_for(lens, panorama)));
  return out;
}

Result<RenderedBracket> CameraRenderer::ideal() const { return render_bracket(PixelFormat::rgb_f32, {1}); }

Result<RenderedBracket> CameraRenderer::eight_bit(int exposures) const {
  if (exposures == 1) return render_bracket(PixelFormat::rgb8, {bright_});
  std::vector<double> full;  // Radiance at full scale.
  for (int i = 0; i < exposures; ++i)
    full.push_back(peak_ * std::pow(std::min(1.0, bright_ / peak_), static_cast<double>(i) / (exposures - 1)));
  return render_bracket(PixelFormat::rgb8, full);
}

Result<RenderedBracket> CameraRenderer::render_bracket(PixelFormat format, const std::vector<double>& radiances) const {
  Result<RigParameters> rig = sim::make_rig("pair", width_, height_, format);
  if (!rig) return rig.status();
  RenderedBracket out;
  out.rig = std::move(*rig);
  out.format = format;
  const sim::SensorModel model = sim::sensor_of(out.rig, format, 1);
  std::vector<sim::Sensor> sensors;
  for (const LensParameters& lens : out.rig.lenses) sensors.emplace_back(lens, model);
  for (std::size_t e = 0; e < radiances.size(); ++e) {
    out.exposures.push_back(sim::exposure_below_saturation(model, radiances[e], 1));
    for (std::size_t k = 0; k < sensors.size(); ++k) {
      out.offsets.push_back(out.bytes.size());
      out.bytes.resize(out.bytes.size() + sensors[k].bytes());
      sensors[k].expose(radiance_[k], {out.exposures.back(), 1, e, static_cast<int>(k)},
                        std::span(out.bytes).subspan(out.offsets.back()));
    }
  }
  return out;
}

}  // namespace lightwell::eval
