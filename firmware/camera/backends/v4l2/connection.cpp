#include "camera/backends/v4l2/connection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <lightwell/text.hpp>

#include "camera/backend.hpp"

namespace lightwell::v4l2 {
namespace {

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

std::string rate_text(double rate) { return formatted("%.4g", rate); }

void note_picture(const Options& options, const NegotiatedFormat& settled, const Layout& layout, bool copied,
                  std::vector<std::string>& notes) {
  const RequestedFormat& wanted = options.wanted;
  const Encoding& encoding = *settled.encoding;
  if (settled.width != wanted.width || settled.height != wanted.height)
    notes.push_back("pictures of " + size_text(settled.width, settled.height) + " in place of " +
                    size_text(wanted.width, wanted.height) + ", which the device does not have");
  if (settled.rate == 0) {
    notes.push_back("the device does not report its frame rate; " + rate_text(wanted.rate) +
                    " frames per second are assumed");
  } else if (std::abs(settled.rate - wanted.rate) > 0.01 * wanted.rate) {
    notes.push_back(rate_text(settled.rate) + " frames a second in place of " + rate_text(wanted.rate));
  }
  if (layout.view_offset > 0)
    notes.push_back("colours come in the order of " + fourcc_text(encoding.fourcc) + ": frames begin " +
                    std::to_string(encoding.skip_columns) + " column and " + std::to_string(encoding.skip_rows) +
                    " row further on, and are " + size_text(layout.view_width, layout.view_height) + " of " +
                    size_text(layout.width, layout.height));
  if (encoding.packing != Packing::none)
    notes.push_back(fourcc_text(encoding.fourcc) + " is converted to " + std::string(to_string(encoding.format)));
  if (copied) notes.emplace_back("the driver has too few buffers to lend them: frames are copied");
  // PixelFormat defines nv12 and yuyv as BT.601, limited range (lightwell/pixel.hpp).
  const bool ycbcr =
      encoding.packing == Packing::none && pixel_layout(encoding.format).sampling == ColorSampling::ycbcr;
  if (ycbcr && settled.quantization == V4L2_QUANTIZATION_FULL_RANGE)
    notes.emplace_back("the driver declares full range, but frames are read as limited range: calibrate the response");
  if (ycbcr && settled.ycbcr != V4L2_YCBCR_ENC_DEFAULT && settled.ycbcr != V4L2_YCBCR_ENC_601)
    notes.emplace_back("the driver declares another matrix than BT.601: colours are slightly wrong");
}

}  // namespace

Result<Connection> connect(const Options& options, std::vector<std::string>& notes) {
  Result<Device> device = Device::open(options.path);
  if (!device) return device.status();
  const Result<SelectedMode> choice = choose_mode(device->modes(options.wanted), options.wanted);
  if (!choice) return choice.status();
  const Result<NegotiatedFormat> settled = device->set_mode(*choice);
  if (!settled) return settled.status();
  std::vector<std::string> of_controls;
  disable_auto_controls(*device, options, of_controls);
  Result<ExposureControl> exposure = configure_exposure(*device, options, settled->rate, of_controls);
  if (!exposure) return exposure.status();

  const bool ours = settled->encoding->packing == Packing::none;
  const int to_lend = required_buffer_count(static_cast<int>(exposure->seconds.size()));
  const int wanted_buffers = kMinQueuedBuffers + (ours ? to_lend : 1);
  Result<MappedBuffers> buffers = device->map_buffers(wanted_buffers);
  if (!buffers) return buffers.status();
  const int given = static_cast<int>(buffers->all().size());
  if (given < 2)
    return Status(StatusCode::resource_exhausted, "v4l2: '" + options.path + "' gives " + std::to_string(given) +
                                                      " buffers, and streaming takes two: ask for a smaller size");
  const bool lends = ours && given >= wanted_buffers;
  const Result<Layout> layout = layout_of(*settled->encoding, settled->width, settled->height, settled->bytes_per_line,
                                          settled->size_image, ours && !lends);
  if (!layout) return layout.status();
  for (const MappedBuffers::Buffer& buffer : buffers->all())
    if (buffer.memory.size() < layout->bytes)
      return Status(StatusCode::internal,
                    "v4l2: '" + options.path + "': the driver's buffers are smaller than its pictures");
  note_picture(options, *settled, *layout, ours && !lends, notes);
  if (!device->stamps_are_monotonic())
    notes.emplace_back("the driver's timestamps are of an unknown clock: the time of arrival is used instead");
  notes.insert(notes.end(), of_controls.begin(), of_controls.end());
  return Connection{std::move(*device),   settled->encoding,   *layout, settled->rate,
                    std::move(*exposure), std::move(*buffers), lends};
}

}  // namespace lightwell::v4l2
