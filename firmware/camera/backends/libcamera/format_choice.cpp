#include "camera/backends/libcamera/format_choice.hpp"

#include <array>
#include <utility>

namespace lightwell::libcam {
namespace {

constexpr std::uint32_t fourcc_of(const char (&name)[5]) {
  std::uint32_t code = 0;
  for (int i = 0; i < 4; ++i) code |= static_cast<std::uint32_t>(static_cast<unsigned char>(name[i])) << (8 * i);
  return code;
}

/// In order of preference. Processed formats are available in any size; raw formats are used only on request, or if
/// there is no other.
constexpr std::array<std::pair<PixelFormat, std::uint32_t>, 6> kFormats{{
    {PixelFormat::nv12, fourcc_of("NV12")},
    {PixelFormat::yuyv, fourcc_of("YUYV")},
    {PixelFormat::rgb8, fourcc_of("BG24")},
    {PixelFormat::bayer_rggb12, fourcc_of("RG12")},
    {PixelFormat::bayer_rggb10, fourcc_of("RG10")},
    {PixelFormat::bayer_rggb8, fourcc_of("RGGB")},
}};

}  // namespace

std::optional<PixelFormat> format_of(std::uint32_t fourcc, std::uint64_t modifier) {
  if (modifier != 0) return std::nullopt;
  for (const auto& [format, code] : kFormats)
    if (code == fourcc) return format;
  return std::nullopt;
}

Result<std::size_t> choose_format(std::span<const SupportedFormat> offered, std::optional<PixelFormat> wanted) {
  for (const auto& entry : kFormats) {
    if (wanted && entry.first != *wanted) continue;
    for (std::size_t i = 0; i < offered.size(); ++i)
      if (format_of(offered[i].fourcc, offered[i].modifier) == entry.first) return i;
  }
  std::string list, known;
  for (const SupportedFormat& o : offered) {
    const std::optional<PixelFormat> ours = format_of(o.fourcc, o.modifier);
    list += (list.empty() ? "" : ", ") + o.name + (ours ? " (" + std::string(to_string(*ours)) + ")" : "");
  }
  for (const auto& entry : kFormats) known += (known.empty() ? "" : ", ") + std::string(to_string(entry.first));
  return Status(StatusCode::failed_precondition,
                (wanted ? "the camera does not offer " + std::string(to_string(*wanted))
                        : "the camera offers no format that Lightwell reads (" + known + ")") +
                    "; it offers: " + (list.empty() ? "nothing" : list));
}

}  // namespace lightwell::libcam
