#include "camera/backends/v4l2/converter.hpp"

#include <algorithm>
#include <cstring>

#include "camera/backends/v4l2/unpack.hpp"

namespace lightwell::v4l2 {

Converter::Converter(const Encoding& encoding, const Layout& layout) : encoding_(encoding), layout_(layout) {
  if (encoding.packing == Packing::jpeg) jpeg_.emplace(layout.width, layout.height);
}

bool Converter::convert(std::span<const std::byte> driver, std::span<std::byte> picture) {
  if (picture.size() < layout_.picture_bytes) return false;
  if (jpeg_) return jpeg_->decode(driver, picture);
  if (driver.size() < layout_.bytes) return false;
  // NV12's chroma rows follow its luma rows, with the same stride.
  const std::size_t rows = layout_.picture_bytes / layout_.view_stride;
  for (std::size_t row = 0; row < rows; ++row)
    convert_row(driver.subspan(row * layout_.stride), picture.subspan(row * layout_.view_stride, layout_.view_stride));
  return true;
}

void Converter::convert_row(std::span<const std::byte> in, std::span<std::byte> out) const {
  // BufferPool::allocate() aligns this memory for any type, so rows can be accessed as 16-bit words.
  const std::span<std::uint16_t> words(reinterpret_cast<std::uint16_t*>(out.data()), out.size() / 2);
  const auto width = static_cast<std::size_t>(layout_.width);
  switch (encoding_.packing) {
    case Packing::packed10:
      return unpack10(in, words);
    case Packing::packed12:
      return unpack12(in, words);
    case Packing::grey:
      return expand_grey(in.first(width), out);
    case Packing::none:
    case Packing::jpeg:
      std::memcpy(out.data(), in.data(), out.size());
  }
}

}  // namespace lightwell::v4l2
