// What is left of each probe's light without the lights that all share.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "field/snapshot.hpp"
#include "field/surround.hpp"
#include "field/views.hpp"

namespace lightwell::field {

/// Sets residual, visibility and own lights of the nodes (one of each view, in order), and occluded_by_geometry of the
/// lights. `members`: of each shared light, its observations. A shared light that a view does not list is either hidden
/// from it or part of its harmonics: it is hidden if geometry says so, or if it would be stronger than a light that the
/// view lists; otherwise the part of it that the bands from 2 on contain is found by least squares and taken out.
void split_residuals(std::span<const ProbeView> views, std::span<const Observation> observations,
                     std::span<const std::vector<std::size_t>> members, const Proxy* proxy,
                     std::span<SharedLight> lights, std::span<FieldNode> nodes);

/// Subtracts what the surroundings alone explain of each residual, and returns them; null without geometry.
[[nodiscard]] std::shared_ptr<const Surround> subtract_surround(std::shared_ptr<const Proxy> proxy,
                                                                std::span<const ProbeView> views,
                                                                std::span<FieldNode> nodes);

/// Coefficient of the variogram of the nodes' residuals and own lights, from all pairs and a prior; marks nodes that
/// differ from one close by more than light changes over the distance. `surround`: what it explains was subtracted.
[[nodiscard]] double estimate_variogram(const FieldOptions& options, bool surround, std::span<const SharedLight> lights,
                                        std::span<FieldNode> nodes);

}  // namespace lightwell::field
