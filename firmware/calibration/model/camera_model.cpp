#include "calibration/model/camera_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lightwell {

CameraModel::CameraModel(const LensParameters& lens)
    : camera_(EquirectangularCamera{lens.width, lens.height}), max_angle_(std::numbers::pi) {
  if (std::holds_alternative<EquirectangularParameters>(lens.model)) return;
  with_camera(lens.model, [&]<template <class> class Camera>(const auto& parameters) {
    const auto camera = Camera<double>::from(values_of(parameters).data());
    camera_ = camera;
    max_angle_ = camera.max_angle_rad(std::min(lens.max_angle_rad, std::numbers::pi));
  });
}

std::optional<PixelPosition> CameraModel::project(Vec3d direction_cv) const {
  const Vec3d d = normalized(direction_cv);
  if (d == Vec3d{} || !is_within(d, max_angle_)) return std::nullopt;
  PixelPosition out;
  const bool known =
      std::visit([&](const auto& camera) { return camera.project(d.x, d.y, d.z, out.x, out.y); }, camera_);
  return known ? std::optional(out) : std::nullopt;
}

std::optional<Vec3d> CameraModel::unproject(PixelPosition pixel) const {
  if (!std::isfinite(pixel.x) || !std::isfinite(pixel.y)) return std::nullopt;
  return std::visit([&](const auto& camera) { return camera.unproject(pixel.x, pixel.y, max_angle_); }, camera_);
}

}  // namespace lightwell
