#include "reference/marker/marker_exposure.hpp"

#include <cmath>
#include <cstddef>
#include <span>

#include "sim/sensor.hpp"

namespace lightwell::reference {

BytePicture expose(const RadiancePicture& picture, const ExposureOptions& options) {
  // Without vignetting, the sensor only uses the image size of the lens.
  LensParameters lens;
  lens.width = picture.width;
  lens.height = picture.height;
  lens.model = EquirectangularParameters{};
  lens.max_angle_rad = pi;
  sim::SensorModel model;
  model.format = PixelFormat::rgb8;
  model.photometry.response.kind = options.srgb ? ResponseCurve::Kind::srgb : ResponseCurve::Kind::linear;
  if (options.electrons > 0) {
    model.photometry.shot_noise = 1 / options.electrons;
    model.photometry.read_noise = options.read_noise_electrons / options.electrons;
  }
  model.radiance_per_unit = options.full_scale;
  model.seed = options.seed;
  sim::Exposure exposure;
  exposure.frame = options.frame;
  const sim::Sensor sensor(lens, model);
  BytePicture out{picture.width, picture.height, std::vector<std::uint8_t>(sensor.bytes())};
  sensor.expose(picture.rgb, exposure, std::as_writable_bytes(std::span(out.rgb)));
  return out;
}

GreyBytes expose_grey(const RadiancePicture& picture, const ExposureOptions& options) {
  RadiancePicture grey = picture;
  for (std::size_t k = 0; k + 2 < grey.rgb.size(); k += 3) {
    const auto y = static_cast<float>(luminance({grey.rgb[k], grey.rgb[k + 1], grey.rgb[k + 2]}));
    grey.rgb[k] = grey.rgb[k + 1] = grey.rgb[k + 2] = y;
  }
  const BytePicture bytes = expose(grey, options);
  GreyBytes out{picture.width, picture.height, {}};
  for (std::size_t k = 1; k < bytes.rgb.size(); k += 3) out.pixels.push_back(bytes.rgb[k]);
  return out;
}

GreyBytes to_grey(const BytePicture& picture) {
  GreyBytes out{picture.width, picture.height, {}};
  for (std::size_t k = 0; k + 2 < picture.rgb.size(); k += 3) {
    const Rgb code{picture.rgb[k] + 0.0, picture.rgb[k + 1] + 0.0, picture.rgb[k + 2] + 0.0};
    out.pixels.push_back(static_cast<std::uint8_t>(std::lround(luminance(code))));
  }
  return out;
}

GreyPicture GreyBytes::view() const { return {pixels, width, height, static_cast<std::size_t>(width)}; }

}  // namespace lightwell::reference
