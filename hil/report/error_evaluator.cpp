#include "report/error_evaluator.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/quantile.hpp>
#include <lightwell/query.hpp>

namespace lightwell::hil {

Evaluation ErrorEvaluator::evaluate(const Descriptor& descriptor, const sim::SceneState& state) {
  std::vector<reference::Rgb>& truth = truth_[state.lamp_factor];
  if (truth.empty()) {
    const sim::Panorama& p = scene_.panorama(state);
    const reference::Panorama world{p.width, p.height, {p.rgb.begin(), p.rgb.end()}};
    truth = reference::irradiance_at(world, normals_);
  }
  std::vector<reference::Rgb> answer;
  answer.reserve(normals_.size());
  const Quat to_probe = state.rotation_world_probe.inverse();
  for (const reference::V3& n : normals_) {
    const Irradiance e = irradiance_at(descriptor, vec_cast<float>(rotate(to_probe, Vec3d{n.x, n.y, n.z})));
    answer.push_back({e.r, e.g, e.b});
  }
  const reference::IrradianceError error = reference::irradiance_error(truth, answer);
  Evaluation v;
  v.error = std::max(error.rms, error.luminance_weighted);
  v.bound = descriptor.bound.total;
  v.flagged = !std::isfinite(v.bound);
  return v;
}

Summary summarize(const std::vector<Evaluation>& evaluations) {
  Summary s;
  s.frames = evaluations.size();
  std::vector<double> errors, ratios;
  for (const Evaluation& v : evaluations) {
    s.held += v.held() ? 1 : 0;
    s.flagged += v.flagged ? 1 : 0;
    errors.push_back(v.error);
    s.largest_error = std::max(s.largest_error, v.error);
    if (!v.flagged && v.error > 0) ratios.push_back(v.bound / v.error);
  }
  s.median_error = errors.empty() ? 0 : upper_quantile(errors, 0.5);
  s.median_bound_over_error = ratios.empty() ? 0 : upper_quantile(ratios, 0.5);
  return s;
}

}  // namespace lightwell::hil
