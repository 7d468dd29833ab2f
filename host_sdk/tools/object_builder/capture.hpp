// A folder of photographs of an object, and the data set made from it.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <lightwell/image_object_encoder.hpp>
#include <lightwell/result.hpp>

namespace lightwell::tool {

/// What object.json in the folder says. Paths of pictures are complete.
struct Capture {
  struct View {
    std::vector<std::string> lit;  ///< One for each light position.
    std::string coverage;
    std::string ambient;  ///< Empty: there is none.
  };
  ObjectRig rig;  ///< columns and rows are those of the first picture.
  std::vector<View> views;
};

/// The name of a picture: the pattern with {view} and {light} replaced by the numbers, from 0.
[[nodiscard]] std::string file_name(std::string pattern, std::size_t view, std::size_t light);

/// Columns and rows of a picture. data_loss if it is none.
[[nodiscard]] Result<std::array<int, 2>> picture_size(const std::string& path);

/// Reads object.json; its fields are those of README.md. No picture is opened. not_found without the file,
/// invalid_argument, naming the field, for a wrong one.
[[nodiscard]] Result<Capture> read_capture(const std::string& folder);

/// Pictures that do not exist, in the order of views and lights.
[[nodiscard]] std::vector<std::string> missing_pictures(const Capture& capture);

/// Sets the size from the first picture.
[[nodiscard]] Status find_size(Capture& capture);

/// A number that changes with what a view is made of: the content of its pictures, the rig and the options.
[[nodiscard]] Result<std::string> fingerprint(const Capture& capture, std::size_t view,
                                              const ObjectEncoderOptions& options);

/// Reads the pictures of a view, PNG or JPEG of 8 or 16 bits in sRGB, and encodes them. invalid_argument, naming the
/// file, for one of another size.
[[nodiscard]] Result<std::string> build_view(const Capture& capture, std::size_t view,
                                             const ObjectEncoderOptions& options);

}  // namespace lightwell::tool
