#include "support/panorama_file.hpp"

#include <algorithm>
#include <numbers>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>

#include <lightwell/equirect.hpp>

namespace lightwell::test {

PanoramaPixels room(int width, const std::function<Radiance(Vec3d)>& rest, const std::vector<Lamp>& lamps) {
  PanoramaPixels p{width, width / 2, {}};
  const double pixel_rad = 2 * std::numbers::pi / width;
  for (int j = 0; j < p.height; ++j) {
    for (int i = 0; i < p.width; ++i) {
      const Vec3d d = equirect_direction((i + 0.5) / p.width, (j + 0.5) / p.height);
      Radiance l = rest(d);
      for (const Lamp& lamp : lamps) {
        const double inside = lamp.radius_rad - angle_between(d, lamp.direction);
        const auto share = static_cast<float>(std::clamp(inside / pixel_rad + 0.5, 0.0, 1.0));
        l = l * (1 - share) + lamp.radiance * share;
      }
      p.rgb.insert(p.rgb.end(), {l.r, l.g, l.b});
    }
  }
  return p;
}

PanoramaPixels room_with_lamp_at_plus_x() {
  const auto walls = [](Vec3d d) {
    const auto up = static_cast<float>(d.y);
    return Radiance{0.6F + 0.3F * up, 0.5F + 0.2F * up, 0.4F + 0.1F * up};
  };
  const double radius = 6 * std::numbers::pi / 180;
  return room(128, walls, {{{1, 0, 0}, radius, {400, 380, 300}}});
}

void write_exr(const std::string& path, const PanoramaPixels& pixels) {
  Imf::Header header(pixels.width, pixels.height);
  Imf::FrameBuffer buffer;
  constexpr std::size_t kFloat = sizeof(float);
  const char* const names[] = {"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) {
    header.channels().insert(names[c], Imf::Channel(Imf::FLOAT));
    // OpenEXR takes a pointer that it could write through; it only reads from it here.
    char* const first = const_cast<char*>(reinterpret_cast<const char*>(pixels.rgb.data() + c));
    buffer.insert(names[c],
                  Imf::Slice(Imf::FLOAT, first, 3 * kFloat, 3 * kFloat * static_cast<std::size_t>(pixels.width)));
  }
  Imf::OutputFile file(path.c_str(), header);
  file.setFrameBuffer(buffer);
  file.writePixels(pixels.height);
}

}  // namespace lightwell::test
