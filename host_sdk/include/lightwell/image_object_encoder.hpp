// Makes the data set of an image-based object (image_object.hpp) from its pictures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/image_object.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// The pictures of one view, linear, rows from the top, all of columns x rows pixels. Borrowed for the call.
struct ViewPictures {
  std::vector<std::span<const Radiance>> lit;  ///< One for each light position, in the order of the rig.
  /// Under light from everywhere, as even as possible. Empty: the mean of `lit`.
  std::span<const Radiance> ambient;
  /// Share of each pixel that the object covers, 0 to 255. Pictures are black, or nearly, where it is 0.
  std::span<const std::uint8_t> coverage;
};

/// Size against quality. Steps are of the square root of the luminance that a pixel sends, where white is 1.
struct ObjectEncoderOptions {
  /// Quantisation step of the relative luminance, 0.0005 to 1. Twice the step: about half the bytes, 4 dB less.
  float luminance_step = 0.055F;
  /// The same of highlights; 0: no highlights are stored.
  float highlight_step = 0.25F;
  /// The same of the base colour, which all lights share.
  float base_step = 0.012F;

  [[nodiscard]] Status validate() const;
};

/// Colour and luminance of a view before compression: equations 3 to 7 of the CyberMirage paper, in linear light.
struct ViewFactors {
  std::vector<Radiance> base;                 ///< (Y_b, U_b, V_b) as RGB.
  std::vector<std::vector<float>> luminance;  ///< L(p_i) = Y(p_i) / Y_b of each light.
  std::vector<std::vector<float>> highlight;  ///< The part of L that has the light's colour, -L to L.
  /// Chromaticity (RGB of luminance 1) of the highlights: white, the light's colour, or where surfaces of two colours
  /// share a pixel, one that the pixel's colours show.
  std::vector<Radiance> second;
  std::size_t reduced = 0;  ///< Pixels whose c was reduced, because U_b or V_b would overflow.
};

/// invalid_argument for a number of pictures other than that of the light positions (naming the missing light
/// position), pictures of unequal size, and values that are negative, not finite or above 1e4.
[[nodiscard]] Status validate(const ObjectRig& rig, const ViewPictures& pictures);

/// Which base colour.
enum class BaseColor : std::uint8_t {
  ambient,     ///< That of the ambient picture (equation 6); no highlights.
  highlights,  ///< The most saturated colour that the pixel has under the lights, and highlights of the light's colour.
};

/// As validate(). A second colour other than white is taken where it lowers the RMS error of a pixel's values by more
/// than about `tolerance`.
[[nodiscard]] Result<ViewFactors> factor_view(const ObjectRig& rig, const ViewPictures& pictures, BaseColor base_color,
                                              float tolerance = 0);

/// Encodes a view; the bytes go into make_image_object(). As validate() of pictures and options. About a second for 61
/// lights of 256 x 256 pixels; allocates about eight bytes for each pixel of each picture.
[[nodiscard]] Result<std::string> encode_view(const ObjectRig& rig, const ViewPictures& pictures,
                                              const ObjectEncoderOptions& options);

/// The file of a data set. invalid_argument as ObjectRig::validate(), for a number of views other than that of turns,
/// and for a view that does not decode.
[[nodiscard]] Result<std::string> make_image_object(const ObjectRig& rig, std::span<const std::string> views);

}  // namespace lightwell
