// The parameters of a lens model as numbers, for solvers. The order of the numbers is that of the parameters struct and
// of the camera class's kNames. The model must not be equirectangular, which has no parameters.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <variant>
#include <vector>

#include <lightwell/calibration.hpp>

#include "calibration/model/double_sphere_camera.hpp"
#include "calibration/model/kannala_brandt_camera.hpp"
#include "calibration/model/mei_camera.hpp"

namespace lightwell {

/// The numbers of a parameters struct.
template <class Parameters>
[[nodiscard]] auto values_of(const Parameters& parameters) {
  return std::bit_cast<std::array<double, sizeof(Parameters) / sizeof(double)>>(parameters);
}

/// The parameters struct with the given numbers.
template <class Parameters>
[[nodiscard]] Parameters from_values(const double* values) {
  std::array<double, sizeof(Parameters) / sizeof(double)> copy;
  std::copy_n(values, copy.size(), copy.begin());
  return std::bit_cast<Parameters>(copy);
}

/// Calls `f.template operator()<Camera>(parameters)` with the camera class template of these parameters.
template <class F>
decltype(auto) with_camera(const ModelParameters& model, F&& f) {
  if (const auto* k = std::get_if<KannalaBrandtParameters>(&model))
    return f.template operator()<KannalaBrandtCamera>(*k);
  if (const auto* d = std::get_if<DoubleSphereParameters>(&model)) return f.template operator()<DoubleSphereCamera>(*d);
  return f.template operator()<MeiCamera>(std::get<MeiParameters>(model));
}

/// The numbers of a model.
[[nodiscard]] inline std::vector<double> parameters_of(const ModelParameters& model) {
  return with_camera(model, []<template <class> class Camera>(const auto& parameters) {
    const auto values = values_of(parameters);
    return std::vector<double>(values.begin(), values.end());
  });
}

/// The names of the parameters, as in calibration.proto.
[[nodiscard]] inline std::vector<const char*> parameter_names(const ModelParameters& model) {
  return with_camera(model, []<template <class> class Camera>(const auto& /*parameters*/) {
    const auto& names = Camera<double>::kNames;
    return std::vector<const char*>(names.begin(), names.end());
  });
}

/// A model of the same kind as `like` with the given numbers, as many as parameters_of(like).
[[nodiscard]] inline ModelParameters with_parameters(const ModelParameters& like, const double* numbers) {
  return with_camera(like, [&]<template <class> class Camera>(const auto& /*parameters*/) -> ModelParameters {
    return from_values<typename Camera<double>::Parameters>(numbers);
  });
}

}  // namespace lightwell
