#include "calibration/model/camera_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/model/camera_domain.hpp"
#include "calibration/model/camera_parameters.hpp"

namespace lightwell {

template <class T>
BasicCameraModel<T>::BasicCameraModel(const LensParameters& lens)
    : camera_(EquirectangularCamera<T>{lens.width, lens.height}), max_angle_(std::numbers::pi) {
  if (std::holds_alternative<EquirectangularParameters>(lens.model)) return;
  with_camera(lens.model, [&]<template <class> class Camera>(const auto& parameters) {
    const auto values = values_of(parameters);
    camera_ = Camera<T>::from(values.data());
    // The domain is computed in double for either T.
    max_angle_ = Camera<double>::from(values.data()).max_angle_rad(std::min(lens.max_angle_rad, std::numbers::pi));
  });
}

template <class T>
std::optional<BasicPixelPosition<T>> BasicCameraModel<T>::project(Vec3<T> direction_cv) const {
  const Vec3<T> d = normalized(direction_cv);
  if (d == Vec3<T>{} || !is_within(d, static_cast<T>(max_angle_))) return std::nullopt;
  BasicPixelPosition<T> out;
  const bool known =
      std::visit([&](const auto& camera) { return camera.project(d.x, d.y, d.z, out.x, out.y); }, camera_);
  if (!known) return std::nullopt;
  return out;
}

template <class T>
std::optional<Vec3<T>> BasicCameraModel<T>::unproject(BasicPixelPosition<T> pixel) const {
  if (!std::isfinite(pixel.x) || !std::isfinite(pixel.y)) return std::nullopt;
  return std::visit([&](const auto& camera) { return camera.unproject(pixel.x, pixel.y, static_cast<T>(max_angle_)); },
                    camera_);
}

template class BasicCameraModel<double>;
template class BasicCameraModel<float>;

}  // namespace lightwell
