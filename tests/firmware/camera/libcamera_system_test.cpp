// Tests of the code that uses libcamera, as far as possible without a camera: manager, list of cameras, formats,
// memory.
#include <cstring>
#include <fcntl.h>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include "camera/backends/libcamera/camera_system.hpp"
#include "camera/backends/libcamera/choices.hpp"
#include "camera/backends/libcamera/libcamera_backend.hpp"

namespace lightwell::libcam {
namespace {

using ::testing::HasSubstr;

Result<std::unique_ptr<CameraBackend>> made(const std::string& rest) {
  const Result<CameraUri> uri = parse_camera_uri("libcamera:" + rest);
  if (!uri) return uri.status();
  return make_libcamera_backend(*uri, {});
}

TEST(LibcameraSystem, AMissingCameraIsReportedWithTheCamerasFound) {
  auto camera = made("no such camera");
  ASSERT_TRUE(camera.ok()) << "only open() accesses the device";
  const Result<CameraInfo> info = (*camera)->open();
  ASSERT_FALSE(info.ok());
  EXPECT_EQ(info.status().code(), StatusCode::not_found);
  EXPECT_THAT(info.status().message(), HasSubstr("no camera 'no such camera'"));
  EXPECT_THAT(info.status().message(), HasSubstr("libcamera " + release() + " found "));
  EXPECT_EQ((*camera)->state(), CameraBackend::State::idle);
  EXPECT_EQ((*camera)->open().status().code(), StatusCode::not_found) << "second open()";
}

TEST(LibcameraSystem, ListsTheCamerasFoundOrReportsNone) {
  const auto system = CameraSystem::get();
  ASSERT_TRUE(system.ok()) << system.status().message();
  const auto none = (*system)->find("999");
  ASSERT_FALSE(none.ok());
  if ((*system)->find("1").ok())
    EXPECT_THAT(none.status().message(), HasSubstr("1: '" + (*(*system)->find("1"))->id()));
  else
    EXPECT_THAT(none.status().message(), HasSubstr("found none: is one connected"));
}

TEST(LibcameraSystem, OneManagerServesAllBackendsAndIsReplacedAfterThem) {
  for (int round = 0; round < 3; ++round) {
    const auto first = CameraSystem::get(), second = CameraSystem::get();
    ASSERT_TRUE(first.ok() && second.ok());
    EXPECT_EQ(*first, *second);
  }
}

TEST(LibcameraSystem, ManagersDoNotOverlapWithBackendsOnSeveralThreads) {
  // libcamera aborts the process if a second manager is created before the first has been destroyed.
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([] {
      for (int i = 0; i < 8; ++i) EXPECT_TRUE(CameraSystem::get().ok());
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(LibcameraSystem, ParametersAreCheckedBeforeTheDeviceIsOpened) {
  EXPECT_EQ(made("1?format=h264").status().code(), StatusCode::invalid_argument);
  EXPECT_EQ(made("").status().code(), StatusCode::invalid_argument);
}

TEST(LibcameraSystem, ABackendThatWasNotOpenedDoesNotStart) {
  class Nobody final : public FrameSink {
    void push(Frame) override { ADD_FAILURE(); }
  } nobody;
  EXPECT_EQ((*made("1"))->start(nobody).code(), StatusCode::failed_precondition);
}

TEST(LibcameraFormats, FourccsEqualThoseOfItsHeaders) {
  namespace formats = ::libcamera::formats;
  const auto ours = [](const ::libcamera::PixelFormat& f) { return format_of(f.fourcc(), f.modifier()); };
  EXPECT_EQ(ours(formats::NV12), PixelFormat::nv12);
  EXPECT_EQ(ours(formats::YUYV), PixelFormat::yuyv);
  EXPECT_EQ(ours(formats::BGR888), PixelFormat::rgb8);
  EXPECT_EQ(ours(formats::SRGGB8), PixelFormat::bayer_rggb8);
  EXPECT_EQ(ours(formats::SRGGB10), PixelFormat::bayer_rggb10);
  EXPECT_EQ(ours(formats::SRGGB12), PixelFormat::bayer_rggb12);
  for (const auto& other : {formats::RGB888, formats::MJPEG, formats::NV21, formats::UYVY, formats::SRGGB10_CSI2P,
                            formats::SBGGR10, formats::SGRBG8, formats::SRGGB16})
    EXPECT_FALSE(ours(other)) << other.toString();
}

TEST(LibcameraControlLimits, AreReadWhateverTheirType) {
  EXPECT_EQ(number_of(::libcamera::ControlValue(std::int32_t{-7})), -7);
  EXPECT_EQ(number_of(::libcamera::ControlValue(std::int64_t{1} << 40)), 1099511627776.0);
  EXPECT_EQ(number_of(::libcamera::ControlValue(1.5F)), 1.5);
  EXPECT_FALSE(number_of(::libcamera::ControlValue()));
  EXPECT_FALSE(number_of(::libcamera::ControlValue(true)));
  const std::array<float, 2> two{1, 2};
  EXPECT_FALSE(number_of(::libcamera::ControlValue(::libcamera::Span<const float>(two))));
}

// ---- memory, with files in place of a driver's buffers

class Memory {
 public:
  explicit Memory(std::size_t bytes) : fd_(::memfd_create("buffer", MFD_CLOEXEC)) {
    std::vector<std::byte> content(bytes);
    for (std::size_t i = 0; i < bytes; ++i) content[i] = static_cast<std::byte>(i * 7);
    EXPECT_EQ(::write(fd_, content.data(), bytes), static_cast<ssize_t>(bytes));
  }
  ~Memory() { ::close(fd_); }
  [[nodiscard]] ::libcamera::FrameBuffer::Plane plane(unsigned offset, unsigned length) const {
    ::libcamera::FrameBuffer::Plane p;
    p.fd = ::libcamera::SharedFD(fd_);  // Duplicates the descriptor, as pipelines do.
    p.offset = offset;
    p.length = length;
    return p;
  }

 private:
  int fd_;
};

constexpr PictureLayout kNv12{PixelFormat::nv12, 32, 16, 64};
constexpr unsigned kLuma = 64 * 16, kChroma = 64 * 8;

TEST(LibcameraMemory, TwoContiguousPlanesAreOnePicture) {
  const Memory file(100 + kLuma + kChroma);
  const std::vector planes{file.plane(100, kLuma), file.plane(100 + kLuma, kChroma)};
  const ::libcamera::FrameBuffer buffer(planes);
  BufferMemory memory;
  ASSERT_TRUE(memory.add(buffer, kNv12).ok());
  const std::span<const std::byte> picture = memory.picture(0);
  ASSERT_EQ(picture.size(), kLuma + kChroma);
  for (std::size_t i = 0; i < picture.size(); ++i) ASSERT_EQ(picture[i], static_cast<std::byte>((i + 100) * 7)) << i;
  memory.begin_reading(0);
  memory.end_reading(0);
}

TEST(LibcameraMemory, SeparatePlanesAreRefused) {
  const Memory file(2 * kLuma + kChroma), other(kChroma);
  BufferMemory memory;
  for (const auto& chroma : {file.plane(kLuma + 64, kChroma), other.plane(kLuma, kChroma)}) {
    const std::vector planes{file.plane(0, kLuma), chroma};
    const ::libcamera::FrameBuffer buffer(planes);
    const Status s = memory.add(buffer, kNv12);
    EXPECT_EQ(s.code(), StatusCode::failed_precondition);
    EXPECT_THAT(s.message(), HasSubstr("lie apart"));
  }
}

TEST(LibcameraMemory, BuffersTooSmallForTheirPictureAreRefused) {
  const Memory file(kLuma + kChroma);
  BufferMemory memory;
  const std::vector planes{file.plane(0, kLuma), file.plane(kLuma, kChroma - 1)};
  EXPECT_THAT(memory.add(::libcamera::FrameBuffer(planes), kNv12).message(), HasSubstr("too small"));
  const std::vector one_plane{file.plane(0, kLuma)};
  EXPECT_THAT(memory.add(::libcamera::FrameBuffer(one_plane), kNv12).message(), HasSubstr("1 planes"));
}

TEST(LibcameraMemory, OutlivesTheBufferAndItsDescriptor) {
  BufferMemory memory;
  {
    const Memory file(64 * 16);
    const std::vector planes{file.plane(0, 64 * 16)};
    const ::libcamera::FrameBuffer buffer(planes);
    ASSERT_TRUE(memory.add(buffer, {PixelFormat::yuyv, 32, 16, 64}).ok());
  }
  EXPECT_EQ(memory.picture(0)[3], static_cast<std::byte>(21));
}

}  // namespace
}  // namespace lightwell::libcam
