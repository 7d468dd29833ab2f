// The indirect parts of equation 5.
#include <algorithm>
#include <string>
#include <utility>

#include <lightwell/relight.hpp>

#include "relight/emitter.hpp"
#include "relight/gather.hpp"
#include "relight/subject.hpp"

namespace lightwell {

Status IndirectOptions::validate() const {
  const auto bad = [](const std::string& name, int value, const std::string& range) {
    return invalid_argument("indirect light: " + name + " is " + std::to_string(value) + ", it must be " + range);
  };
  if (samples < 1 || samples > 65536) return bad("samples", samples, "1 to 65536");
  if (bounces < 1 || bounces > 64) return bad("bounces", bounces, "1 to 64");
  if (step < 1 || step > 16) return bad("step", step, "1 to 16");
  if (!(surface_reflectance >= 0 && surface_reflectance <= 1))
    return invalid_argument("indirect light: surface_reflectance is " + std::to_string(surface_reflectance) +
                            ", it must be 0 to 1");
  return {};
}

Result<IndirectLight> simulate_indirect(const RelightSubject& subject, std::span<const BasisLight> basis,
                                        std::span<const PatternLight> patterns, const AlphaMaps& alpha,
                                        const IndirectOptions& options) {
  if (Status status = options.validate(); !status.ok()) return status;
  if (Status status = relight::validate(basis, patterns); !status.ok()) return status;
  if (alpha.lights() != basis.size())
    return invalid_argument("alpha has " + std::to_string(alpha.lights()) + " basis lights, these are " +
                            std::to_string(basis.size()));
  const relight::SubjectData& data = subject.data();
  auto rays = data.surface->rays();
  if (!rays) return rays.status();
  auto gather = relight::GatherRays::cast(data, **rays, options);
  if (!gather) return gather.status();
  IndirectLight out;
  out.simulated_pixels = gather->simulated_pixels();
  out.existing.resize(basis.size());
  for (std::size_t i = 0; i < basis.size(); ++i)
    if (alpha.has_map(i)) gather->simulate(relight::DirectLight(data, **rays, basis[i]), out.existing[i]);
  std::vector<relight::PatternSampler> samplers;
  for (const PatternLight& pattern : patterns) samplers.emplace_back(pattern);
  gather->simulate(relight::DirectLight(data, **rays, samplers), out.spatial);
  return out;
}

}  // namespace lightwell
