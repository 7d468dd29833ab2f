// The file of a data set: rig, table of views, views.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include <lightwell/bytes.hpp>
#include <lightwell/image_object.hpp>
#include <lightwell/image_object_encoder.hpp>

#include "image_object/view_codec.hpp"

namespace lightwell {
namespace {

constexpr std::string_view kMagic = "LWIO";
constexpr std::uint32_t kVersion = 1;
/// Magic, version, columns, rows, lights, views, three floats; before the tables and the checksum.
constexpr std::size_t kFixedBytes = 4 + 5 * 4 + 3 * 4;
constexpr std::size_t kLightBytes = 3 * 4, kViewBytes = 3 * 4, kChecksumBytes = 4;

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

std::size_t header_bytes(std::size_t lights, std::size_t views) {
  return kFixedBytes + lights * kLightBytes + views * kViewBytes;
}

void append(std::string& out, std::uint32_t value) {
  std::array<char, 4> bytes{};
  put_le(bytes.data(), value);
  out.append(bytes.data(), bytes.size());
}
void append(std::string& out, float value) { append(out, std::bit_cast<std::uint32_t>(value)); }

std::uint32_t word(std::string_view bytes, std::size_t at) { return get_le<std::uint32_t>(bytes.data() + at); }
float real(std::string_view bytes, std::size_t at) { return std::bit_cast<float>(word(bytes, at)); }

Status damaged(const std::string& what) {
  return {StatusCode::data_loss, "the image-based object is damaged: " + what + "; get the file again"};
}

Status out_of_range(const std::string& member, const std::string& value, const std::string& rule) {
  return invalid_argument("ObjectRig::" + member + " is " + value + ": it must be " + rule);
}

}  // namespace

Status ObjectRig::validate() const {
  for (const auto& [name, side] : {std::pair{"columns", columns}, std::pair{"rows", rows}})
    if (side < 1 || side > kMaxSide)
      return out_of_range(name, std::to_string(side), "1 to " + std::to_string(kMaxSide));
  if (light_positions.empty() || light_positions.size() > kMaxLights)
    return out_of_range("light_positions", "a list of " + std::to_string(light_positions.size()),
                        "a list of 1 to " + std::to_string(kMaxLights));
  if (turns_rad.empty() || turns_rad.size() > kMaxViews)
    return out_of_range("turns_rad", "a list of " + std::to_string(turns_rad.size()),
                        "a list of 1 to " + std::to_string(kMaxViews));
  for (std::size_t i = 0; i < light_positions.size(); ++i)
    if (const Vec3f d = normalized(light_positions[i]); !(dot(d, d) > 0))
      return invalid_argument("ObjectRig::light_positions: position " + std::to_string(i) +
                              " is at the object's origin, or not finite");
  for (std::size_t i = 0; i < turns_rad.size(); ++i)
    if (!std::isfinite(turns_rad[i]))
      return invalid_argument("ObjectRig::turns_rad: the turn of view " + std::to_string(i) + " is not finite");
  for (const auto& [name, value] :
       {std::pair{"reference_irradiance", reference_irradiance}, std::pair{"camera_distance_m", camera_distance_m},
        std::pair{"half_width_m", half_width_m}})
    if (!(value > 0) || !std::isfinite(value)) return out_of_range(name, std::to_string(value), "above 0 and finite");
  return {};
}

Result<std::string> make_image_object(const ObjectRig& rig, std::span<const std::string> views) {
  if (const Status valid = rig.validate(); !valid.ok()) return valid;
  if (views.size() != rig.turns_rad.size())
    return invalid_argument("there are " + std::to_string(views.size()) + " views for " +
                            std::to_string(rig.turns_rad.size()) + " turns");
  std::string out(kMagic);
  for (const std::size_t n : {std::size_t{kVersion}, static_cast<std::size_t>(rig.columns),
                              static_cast<std::size_t>(rig.rows), rig.light_positions.size(), views.size()})
    append(out, static_cast<std::uint32_t>(n));
  for (const float f : {rig.reference_irradiance, rig.camera_distance_m, rig.half_width_m}) append(out, f);
  for (const Vec3f& p : rig.light_positions)
    for (const float f : {p.x, p.y, p.z}) append(out, f);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto bytes = bytes_of(views[i]);
    if (views[i].size() > std::numeric_limits<std::uint32_t>::max())
      return invalid_argument("view " + std::to_string(i) + " has more than 4 GiB");
    if (const auto decoded = image_object::read_view(rig, rig.turns_rad[i], bytes); !decoded.ok())
      return invalid_argument("view " + std::to_string(i) + ": " + decoded.status().message());
    append(out, rig.turns_rad[i]);
    append(out, static_cast<std::uint32_t>(bytes.size()));
    append(out, crc32c(bytes));
  }
  append(out, crc32c(bytes_of(out)));
  for (const std::string& view : views) out += view;
  return out;
}

Result<ImageObject> ImageObject::from_bytes(std::string bytes) {
  const std::string_view all = bytes;
  if (all.size() < kFixedBytes || all.substr(0, kMagic.size()) != kMagic)
    return invalid_argument("this is no image-based object: the file does not begin with LWIO");
  if (const std::uint32_t version = word(all, 4); version != kVersion)
    return invalid_argument("the image-based object has format version " + std::to_string(version) +
                            ", this library reads version 1: update it");
  const std::size_t lights = word(all, 16), views = word(all, 20);
  if (lights > ObjectRig::kMaxLights || views > ObjectRig::kMaxViews)
    return damaged("it has " + std::to_string(lights) + " lights and " + std::to_string(views) + " views");
  const std::size_t header = header_bytes(lights, views);
  if (all.size() < header + kChecksumBytes) return damaged("it ends in its header");
  if (word(all, header) != crc32c(bytes_of(all.substr(0, header))))
    return damaged("the checksum of its header differs");
  ImageObject out;
  if (word(all, 8) > ObjectRig::kMaxSide || word(all, 12) > ObjectRig::kMaxSide)
    return damaged("its size is too large");
  out.rig_.columns = static_cast<int>(word(all, 8));
  out.rig_.rows = static_cast<int>(word(all, 12));
  out.rig_.reference_irradiance = real(all, 24);
  out.rig_.camera_distance_m = real(all, 28);
  out.rig_.half_width_m = real(all, 32);
  for (std::size_t i = 0; i < lights; ++i) {
    const std::size_t at = kFixedBytes + i * kLightBytes;
    out.rig_.light_positions.push_back({real(all, at), real(all, at + 4), real(all, at + 8)});
  }
  std::size_t offset = header + kChecksumBytes;
  for (std::size_t i = 0; i < views; ++i) {
    const std::size_t at = kFixedBytes + lights * kLightBytes + i * kViewBytes;
    out.rig_.turns_rad.push_back(real(all, at));
    out.entries_.push_back({offset, word(all, at + 4), word(all, at + 8)});
    offset += out.entries_.back().size;
  }
  if (offset != all.size()) return damaged("its views have not the size that its table says");
  if (const Status valid = out.rig_.validate(); !valid.ok()) return damaged(valid.message());
  out.bytes_ = std::make_shared<const std::string>(std::move(bytes));
  return out;
}

std::size_t ImageObject::view_bytes(std::size_t view) const { return view < entries_.size() ? entries_[view].size : 0; }

Result<std::span<const std::byte>> ImageObject::checked_bytes(std::size_t view) const {
  if (view >= entries_.size())
    return Status(StatusCode::not_found,
                  "there is no view " + std::to_string(view) + ": the object has " + std::to_string(entries_.size()));
  const Entry& entry = entries_[view];
  const auto bytes = bytes_of(std::string_view(*bytes_).substr(entry.offset, entry.size));
  if (crc32c(bytes) != entry.crc) return damaged("the checksum differs").in("view " + std::to_string(view));
  return bytes;
}

Result<ObjectView> ImageObject::view(std::size_t view) const {
  const auto bytes = checked_bytes(view);
  if (!bytes.ok()) return bytes.status();
  auto decoded = image_object::read_view(rig_, rig_.turns_rad[view], *bytes);
  if (!decoded.ok()) return decoded.status().in("view " + std::to_string(view));
  return ObjectView(std::move(decoded.value()));
}

Result<std::vector<std::uint8_t>> ImageObject::coverage(std::size_t view) const {
  const auto bytes = checked_bytes(view);
  if (!bytes.ok()) return bytes.status();
  auto decoded = image_object::read_coverage(rig_, *bytes);
  if (!decoded.ok()) return decoded.status().in("view " + std::to_string(view));
  return std::move(decoded->coverage);
}

std::optional<std::size_t> ImageObject::nearest_view(Vec3d eye) const {
  if (!std::isfinite(eye.x + eye.z) || (eye.x == 0 && eye.z == 0) || rig_.turns_rad.empty()) return std::nullopt;
  // R_y(turn) turns the eye to the camera, which is at +Z.
  const double turn = -std::atan2(eye.x, eye.z);
  const auto difference = [&](float other) {
    return std::abs(std::remainder(static_cast<double>(other) - turn, 2 * std::numbers::pi));
  };
  return static_cast<std::size_t>(std::ranges::min_element(rig_.turns_rad, {}, difference) - rig_.turns_rad.begin());
}

int ObjectView::columns() const { return decoded_->columns; }
int ObjectView::rows() const { return decoded_->rows; }
float ObjectView::turn_rad() const { return decoded_->turn_rad; }
std::span<const std::uint8_t> ObjectView::coverage() const { return decoded_->coverage; }

std::size_t ObjectView::bytes_read() const {
  const image_object::DecodedView& d = *decoded_;
  return d.base.size() * sizeof(image_object::BasePixel) + d.coverage.size() +
         (d.luminance.coefficients.size() + d.highlight.coefficients.size()) * sizeof(image_object::Coefficient) +
         (d.luminance.basis.size() + d.highlight.basis.size()) * sizeof(float) +
         d.live.size() * (sizeof(std::uint32_t) * 3 + sizeof(float));
}

}  // namespace lightwell
