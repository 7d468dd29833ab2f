// The bytes of one view.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include <lightwell/image_object.hpp>
#include <lightwell/result.hpp>

#include "image_object/view_data.hpp"

namespace lightwell::image_object {

/// A view before entropy coding. Blocks of levels: [live block * planes + plane].
struct QuantizedView {
  DecodedView layout;  ///< Its coverage, live blocks and sizes count.
  float base_step = 0;
  std::vector<BlockLevels> base;  ///< kBasePlanes.
  LightPlanes luminance, highlight;
  std::vector<BlockLevels> luminance_levels, highlight_levels;
};

/// The basis is rounded to what the bytes hold.
void round_basis(LightPlanes& planes, std::size_t lights);

[[nodiscard]] std::string write_view(const QuantizedView& view);

/// data_loss for bytes that are no view of that rig.
[[nodiscard]] Result<std::shared_ptr<const DecodedView>> read_view(const ObjectRig& rig, float turn_rad,
                                                                   std::span<const std::byte> bytes);

/// The same, without what follows the coverage.
[[nodiscard]] Result<DecodedView> read_coverage(const ObjectRig& rig, std::span<const std::byte> bytes);

}  // namespace lightwell::image_object
