// Streams of captured planes of the gRPC link.
#include <gtest/gtest.h>

#include <lightwell/plane_codec.hpp>

#include "firmware/link/probe_server.hpp"
#include "support/captured_planes.hpp"

namespace lightwell::test {
namespace {

constexpr const char* kStreamPlane = "/lightwell.v1.ProbeService/StreamPlane";

class GrpcPlaneTest : public GrpcLinkTest {
 protected:
  static std::string trimmed(const std::optional<std::string>& text) { return plane_message_name(text); }
};

TEST_F(GrpcPlaneTest, AClientGetsTheWholePlaneAndThenChanges) {
  link_->publish_plane(plane_update(1, 1, 3));
  RawStream first(connect(*link_), kStreamPlane);
  EXPECT_EQ(trimmed(first.next()), "whole1.0");
  EXPECT_EQ(trimmed(first.next()), "whole1.1");
  EXPECT_EQ(trimmed(first.next()), "whole1.2");
  link_->publish_plane(plane_update(2, 2, 3));
  EXPECT_EQ(trimmed(first.next()), "change2.0");
  EXPECT_EQ(trimmed(first.next()), "change2.1");
  RawStream second(connect(*link_), kStreamPlane);
  EXPECT_EQ(trimmed(second.next()), "whole2.0");
  EXPECT_EQ(trimmed(second.next()), "whole2.1");
  EXPECT_EQ(trimmed(second.next()), "whole2.2");
  link_->publish_plane(plane_update(3, 1, 3));
  EXPECT_EQ(trimmed(first.next()), "change3.0");
  EXPECT_EQ(trimmed(second.next()), "change3.0");
  // It is no client of descriptors, and gets none.
  EXPECT_EQ(link_->counters().clients, 0U);
  link_->publish(message(1));
  link_->publish_plane(plane_update(4, 1, 3));
  EXPECT_EQ(trimmed(first.next()), "change4.0");
}

TEST_F(GrpcPlaneTest, ASlowClientMissesUpdatesAndGetsTheNewestWhole) {
  link_->publish_plane(plane_update(0, 1, 1));
  RawStream slow(connect(*link_), kStreamPlane);
  ASSERT_EQ(trimmed(slow.next()), "whole0.0");
  // 60 MB: more than gRPC and the kernel hold for a client that does not read.
  for (int number = 1; number <= 1000; ++number) link_->publish_plane(plane_update(number, 1, 1, 60'000));
  // Changes without a gap; after a gap a whole plane; the newest at last.
  int last = 0, gaps = 0;
  while (last < 1000) {
    const std::string got = trimmed(slow.next());
    ASSERT_TRUE(got.starts_with("change") || got.starts_with("whole")) << got << " after " << last;
    const bool whole = got.starts_with("whole");
    const int number = std::stoi(got.substr(whole ? 5 : 6));
    ASSERT_GT(number, last);
    if (!whole) {
      ASSERT_EQ(number, last + 1);
    }
    gaps += whole ? 1 : 0;
    last = number;
  }
  EXPECT_GE(gaps, 1) << "60 MB were buffered without being read";
}

/// No update is lost to a client that reads: the newest one comes without another publish_plane().
TEST_F(GrpcPlaneTest, TheNewestUpdateAlwaysArrives) {
  RawStream reader(connect(*link_), kStreamPlane);
  link_->publish_plane(plane_update(0, 1, 1));
  ASSERT_EQ(trimmed(reader.next()), "whole0.0");
  for (int round = 1; round <= 200; ++round) {
    link_->publish_plane(plane_update(3 * round, 1, 1));
    link_->publish_plane(plane_update(3 * round + 1, 1, 1));
    link_->publish_plane(plane_update(3 * round + 2, 1, 1));
    const std::string newest = std::to_string(3 * round + 2) + ".0";
    std::string got;
    do got = trimmed(reader.next());
    while (got != "nothing" && !got.ends_with(newest));
    ASSERT_NE(got, "nothing") << "waited for " << newest;
  }
}

TEST_F(GrpcPlaneTest, StreamsEndWithTheLink) {
  RawStream stream(connect(*link_), kStreamPlane);
  // The first message shows that the stream is registered.
  link_->publish_plane(plane_update(1, 1, 1));
  ASSERT_EQ(trimmed(stream.next()), "whole1.0");
  link_->stop();
  EXPECT_EQ(stream.end().error_code(), grpc::StatusCode::UNAVAILABLE);
}

/// A link that keeps what it is given.
class KeepingLink final : public Link {
 public:
  using Planes = std::vector<std::shared_ptr<const EncodedPlane>>;

  explicit KeepingLink(Planes& planes) : planes_(planes) {}

  Status start() override { return {}; }
  void publish(const EncodedDescriptor&) override {}
  void publish_plane(const std::shared_ptr<const EncodedPlane>& plane) override { planes_.push_back(plane); }
  void stop() override {}
  LinkCounters counters() const override { return {}; }
  std::string_view name() const override { return "keeping"; }
  std::string address() const override { return {}; }

 private:
  Planes& planes_;
};

/// What two links received of a plane that was published twice.
struct TwoLinks {
  explicit TwoLinks(Publisher& publisher) {
    for (KeepingLink::Planes* planes : {&first, &second}) publisher.add(std::make_unique<KeepingLink>(*planes));
    const CapturedPlane plane = linear_plane();
    EXPECT_TRUE(publisher.publish_plane(plane).ok());
    EXPECT_TRUE(publisher.publish_plane(plane).ok());
    CapturedPlane bad = plane;
    bad.info.size_m = -1;
    EXPECT_EQ(publisher.publish_plane(bad).code(), StatusCode::invalid_argument);
  }

  KeepingLink::Planes first, second;
};

TEST(PublishPlane, EncodesOnceForAllLinks) {
  Publisher publisher({.images = ImageRecipients::all_clients, .key_interval = {1'000'000'000'000}});
  const TwoLinks got(publisher);
  ASSERT_EQ(got.first.size(), 2U);
  EXPECT_EQ(got.first, got.second) << "the same objects";
  ASSERT_EQ(got.first[0]->changes.size(), 1U);
  EXPECT_EQ(decode_plane_update(got.first[0]->changes[0])->tiles.size(), 6U);
  ASSERT_EQ(got.first[1]->changes.size(), 1U);
  EXPECT_EQ(decode_plane_update(got.first[1]->changes[0])->tiles.size(), 0U);
  ASSERT_EQ(got.first[1]->whole.size(), 1U);
  EXPECT_EQ(decode_plane_update(got.first[1]->whole[0])->tiles.size(), 6U);
}

TEST(PublishPlane, GivesNobodyImagesByDefault) {
  Publisher publisher;
  const TwoLinks got(publisher);
  ASSERT_EQ(got.first.size(), 2U);
  for (const auto& plane : got.first)
    for (const auto* messages : {&plane->changes, &plane->whole}) {
      ASSERT_FALSE(messages->empty());
      for (const auto& bytes : *messages) {
        const Result<PlaneUpdate> update = decode_plane_update(bytes);
        ASSERT_TRUE(update.ok()) << update.status().message();
        EXPECT_EQ(update->layout.texture_edge(), 0);
      }
    }
}

/// Tiles are repeated by the time of the call: the plane's own time stays while no frame contributes.
TEST(PublishPlane, RepeatsTilesOfAPlaneThatDoesNotChange) {
  KeepingLink::Planes got;
  Publisher publisher({.key_interval = {1'000'000}});
  publisher.add(std::make_unique<KeepingLink>(got));
  const CapturedPlane plane = linear_plane();
  ASSERT_TRUE(publisher.publish_plane(plane).ok());
  EXPECT_TRUE(becomes_true("tiles are repeated", [&] {
    EXPECT_TRUE(publisher.publish_plane(plane).ok());
    return decode_plane_update(got.back()->changes.front())->tiles.size() == 2U;
  }));
}

}  // namespace
}  // namespace lightwell::test
