#include "estimator.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include <lightwell/conventions.h>

namespace lightwell::xr {
namespace {

XrVector3f vector_of(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

XrLightEstimateStateANDROID state_of(std::int32_t state) {
  return state == 0 ? XR_LIGHT_ESTIMATE_STATE_VALID_ANDROID : XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID;
}

const char* name_of(XrReferenceSpaceType space) {
  if (space == XR_REFERENCE_SPACE_TYPE_STAGE) return "stage";
  return space == XR_REFERENCE_SPACE_TYPE_VIEW ? "view" : "local";
}

/// The estimate of to_openxr(), times `scale`.
lw_status convert(const lw_lighting* light, lw_openxr_harmonics kind, float scale, lw_openxr& out) {
  lw_conversion_options options{};
  options.size = sizeof options;
  options.residual = LW_RESIDUAL_LEFT_OUT;
  for (std::size_t i = 0; i < 9; i += 4) options.color[i] = scale;
  out.size = sizeof out;
  return lw_lighting_to_openxr(light, kind, LW_SH_CONDON_SHORTLEY, &options, &out);
}

}  // namespace

void EstimateParts::set_state(XrLightEstimateStateANDROID state) const {
  estimate->state = state;
  if (directional != nullptr) directional->state = state;
  if (ambient != nullptr) ambient->state = state;
  if (harmonics != nullptr) harmonics->state = state;
  if (cube != nullptr) cube->state = state;
}

XrResult Estimator::make(Instance& instance, XrSession session, const XrCubemapLightEstimatorCreateInfoANDROID* cube,
                         std::shared_ptr<Estimator>& out) {
  std::shared_ptr<Estimator> made(new Estimator(instance, session));
  XrReferenceSpaceCreateInfo info{};
  info.type = XR_TYPE_REFERENCE_SPACE_CREATE_INFO;
  info.referenceSpaceType = instance.configuration.space;
  info.poseInReferenceSpace.orientation.w = 1;
  const XrResult result = instance.runtime.create_reference_space(session, &info, &made->reference_);
  if (result == XR_ERROR_REFERENCE_SPACE_UNSUPPORTED) {
    made->reference_ = XR_NULL_HANDLE;
    instance.messages.error("xrCreateLightEstimatorANDROID",
                            std::string("LIGHTWELL_XR_SPACE=") + name_of(info.referenceSpaceType) +
                                ": the runtime has no such space; state the pose of the probe in local");
    return XR_ERROR_RUNTIME_FAILURE;
  }
  if (XR_FAILED(result)) {
    made->reference_ = XR_NULL_HANDLE;
    return result;
  }
  lw_lighting* light = nullptr;
  if (lw_lighting_create(&light) != LW_OK) return XR_ERROR_OUT_OF_MEMORY;
  made->light_.reset(light);
  if (cube != nullptr) {
    made->cube_ = CubeRenderer::make(*cube, instance.source, instance.configuration.scale);
    if (!made->cube_) return XR_ERROR_OUT_OF_MEMORY;
  }
  instance.source.add_user();
  made->counted_ = true;
  out = std::move(made);
  return XR_SUCCESS;
}

Estimator::~Estimator() {
  if (reference_ != XR_NULL_HANDLE) instance_.runtime.destroy_space(reference_);
  cube_.reset();
  if (counted_) instance_.source.remove_user();
}

XrResult Estimator::locate(const XrLightEstimateGetInfoANDROID& request, std::optional<Pose>& out) const {
  XrSpaceLocation location{};
  location.type = XR_TYPE_SPACE_LOCATION;
  const XrResult result = instance_.runtime.locate_space(reference_, request.space, request.time, &location);
  if (XR_FAILED(result) || (location.locationFlags & XR_SPACE_LOCATION_ORIENTATION_VALID_BIT) == 0) return result;
  const auto& [q, p] = location.pose;
  out.emplace(Pose{Quat{q.x, q.y, q.z, q.w}, {}});
  // No part of an estimate depends on the position.
  if ((location.locationFlags & XR_SPACE_LOCATION_POSITION_VALID_BIT) != 0) out->translation = {p.x, p.y, p.z};
  return result;
}

XrResult Estimator::estimate(const XrLightEstimateGetInfoANDROID& request, const EstimateParts& parts) {
  parts.set_state(XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID);
  std::int64_t host_ns = 0;
  if (const XrResult r = instance_.clock.to_host(request.time, host_ns); XR_FAILED(r)) return r;
  std::optional<Pose> T_space_reference;
  const XrResult located = locate(request, T_space_reference);
  const LightSource::Connection source = instance_.source.connection();
  if (XR_FAILED(located) || !T_space_reference || !source.probe) return located;

  const Pose T_space_probe = compose(*T_space_reference, source.T_space_probe);
  const auto& [q, p] = T_space_probe;
  const double position[] = {p.x, p.y, p.z}, rotation[] = {q.x, q.y, q.z, q.w};
  const lw_openxr_harmonics kind =
      parts.harmonics != nullptr && parts.harmonics->kind == XR_SPHERICAL_HARMONICS_KIND_TOTAL_ANDROID
          ? LW_OPENXR_TOTAL
          : LW_OPENXR_AMBIENT;
  lw_openxr light{};
  {
    const std::lock_guard lock(mutex_);
    if (lw_probe_at(source.probe.get(), host_ns, light_.get()) != LW_OK ||
        lw_lighting_in_world(light_.get(), position, rotation, light_.get()) != LW_OK ||
        convert(light_.get(), kind, instance_.configuration.scale, light) != LW_OK)
      return XR_ERROR_RUNTIME_FAILURE;
  }
  // Light that is too old has values as well.
  if (light.validity != LW_VALID || light.state != 0) return located;

  if (const XrResult r = instance_.clock.to_xr(light.lastUpdatedTime, parts.estimate->lastUpdatedTime); XR_FAILED(r))
    return r;
  parts.estimate->state = XR_LIGHT_ESTIMATE_STATE_VALID_ANDROID;
  if (parts.directional != nullptr) {
    parts.directional->state = state_of(light.directionalLightState);
    parts.directional->intensity = vector_of(light.directionalLightIntensity);
    parts.directional->direction = vector_of(light.directionalLightDirection);
  }
  if (parts.ambient != nullptr) {
    parts.ambient->state = state_of(light.ambientLightState);
    parts.ambient->intensity = vector_of(light.ambientLightIntensity);
    parts.ambient->colorCorrection = vector_of(light.ambientLightColorCorrection);
  }
  if (parts.harmonics != nullptr) {
    parts.harmonics->state = state_of(light.sphericalHarmonicsState);
    static_assert(sizeof parts.harmonics->coefficients == sizeof light.sphericalHarmonicsCoefficients);
    std::memcpy(parts.harmonics->coefficients, light.sphericalHarmonicsCoefficients,
                sizeof light.sphericalHarmonicsCoefficients);
  }
  if (parts.cube != nullptr && cube_ != nullptr) {
    const std::int64_t mid_exposure_ns = cube_->copy(T_space_probe, *parts.cube);
    if (mid_exposure_ns != 0) return instance_.clock.to_xr(mid_exposure_ns, parts.cube->centerExposureTime);
  }
  return located;
}

}  // namespace lightwell::xr
