// The camera's preview on the web link: authentication, consent, waiting, limits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/link/web_probe.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kGet = "GET /v1/preview.jpg HTTP/1.1";

PreviewJpeg picture_of(const std::string& bytes) {
  const auto* const first = reinterpret_cast<const std::byte*>(bytes.data());
  return std::make_shared<const std::vector<std::byte>>(first, first + bytes.size());
}

/// As large as a picture may be; it needs several writes.
const std::string kPicture = "\xff\xd8" + std::string(60'000, 'p') + "\xff\xd9";

class WebPreviewTest : public WebLinkTest {
 protected:
  HttpReply get(const std::string& head = kGet) { return RawWebClient(*link_).request(head); }
};

TEST_F(WebPreviewTest, APictureIsServedAndNotCached) {
  commands_.set_preview(picture_of(kPicture));
  const HttpReply reply = get();
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, kPicture);
  EXPECT_THAT(reply.head, AllOf(HasSubstr("content-type: image/jpeg"), HasSubstr("no-store"), HasSubstr("nosniff")));
  const HttpReply head = get("HEAD /v1/preview.jpg HTTP/1.1");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.body, "");
  EXPECT_EQ(link_->counters().messages_refused, 0U);
}

TEST_F(WebPreviewTest, WithoutConsentItIsRefusedWithTheReasonAndCounted) {
  commands_.set_preview(Status(StatusCode::failed_precondition, "set images: IMAGE_RECIPIENTS_ALL_CLIENTS"));
  const HttpReply reply = get();
  EXPECT_EQ(reply.status, 403);
  EXPECT_EQ(reply.body, "set images: IMAGE_RECIPIENTS_ALL_CLIENTS\n");
  EXPECT_EQ(link_->counters().messages_refused, 1U);
}

TEST_F(WebPreviewTest, ARequestWaitsForThePicture) {
  commands_.set_preview(PreviewJpeg());
  RawWebClient client(*link_);
  client.send("GET /v1/preview.jpg HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  ASSERT_TRUE(becomes_true("the link asks again", [&] { return commands_.preview_calls() > 2; }));
  RawWebClient reader(*link_);
  ASSERT_EQ(reader.upgrade().status, 101);
  link_->publish(message(1));
  EXPECT_EQ(reader.next(), text_of(message(1))) << "others are served meanwhile";
  commands_.set_preview(picture_of("picture"));
  EXPECT_THAT(client.receive(), HasSubstr("HTTP/1.1 200"));
}

TEST_F(WebPreviewTest, WithoutFramesTheWaitEnds) {
  commands_.set_preview(PreviewJpeg());
  const HttpReply reply = get();
  EXPECT_EQ(reply.status, 503);
  EXPECT_THAT(reply.body, HasSubstr("no frame"));
  const int calls = commands_.preview_calls();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(commands_.preview_calls(), calls) << "nobody waits any more";
}

TEST_F(WebPreviewTest, AClientThatLeavesWhileItWaitsIsForgotten) {
  commands_.set_preview(PreviewJpeg());
  {
    RawWebClient client(*link_);
    client.send("GET /v1/preview.jpg HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    ASSERT_TRUE(becomes_true("it waits", [&] { return commands_.preview_calls() > 1; }));
  }
  ASSERT_TRUE(becomes_true("the link asks no more", [&] {
    const int calls = commands_.preview_calls();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return commands_.preview_calls() == calls;
  }));
  commands_.set_preview(picture_of("picture"));
  EXPECT_EQ(get().status, 200);
}

TEST_F(WebPreviewTest, TooManyRequestsAreRefusedBeforeThePipelineIsAsked) {
  commands_.set_preview(picture_of("picture"));
  int refused = 0;
  for (int i = 0; i < 60; ++i) refused += get().status == 429 ? 1 : 0;
  EXPECT_GT(refused, 0);
  EXPECT_EQ(commands_.preview_calls(), 60 - refused);
  EXPECT_EQ(link_->counters().messages_refused, static_cast<std::uint64_t>(refused));
  ASSERT_TRUE(becomes_true("after a pause it is served again", [&] { return get().status == 200; }));
}

TEST_F(WebPreviewTest, OtherSpellingsOfThePathAreNotFoundAndOtherMethodsRefused) {
  commands_.set_preview(picture_of("picture"));
  for (const char* path : {"/v1/preview.jpg?x", "/v1/preview.jpg/", "/v1/preview", "/preview.jpg"})
    EXPECT_EQ(get("GET " + std::string(path) + " HTTP/1.1").status, 404) << path;
  EXPECT_EQ(get("POST /v1/preview.jpg HTTP/1.1\r\nContent-Length: 0").status, 405);
  EXPECT_EQ(commands_.preview_calls(), 0);
}

TEST_F(WebPreviewTest, PagesOfOtherOriginsAreRefused) {
  commands_.set_preview(picture_of("picture"));
  EXPECT_EQ(get(std::string(kGet) + "\r\nOrigin: http://evil.example").status, 403);
  EXPECT_EQ(commands_.preview_calls(), 0);
}

TEST_F(GuardedWebTest, ThePreviewNeedsAToken) {
  commands_.set_preview(picture_of("picture"));
  listen(LinkSecurity::tls);
  const auto get = [&](const std::string& header) {
    return RawWebClient(*link_, trusting()).request(std::string(kGet) + "\r\n" + header);
  };
  for (const std::string& header : {std::string("Accept: */*"), "Authorization: Bearer " + std::string(43, 'x'),
                                    "Authorization: Bearer " + pair_client(-1).credentials.token}) {
    const HttpReply refused = get(header);
    EXPECT_EQ(refused.status, 401) << header;
    EXPECT_THAT(refused.body, Not(HasSubstr("picture")));
  }
  EXPECT_EQ(commands_.preview_calls(), 0);
  const HttpReply accepted = get("Authorization: Bearer " + pair_client().credentials.token);
  EXPECT_EQ(accepted.status, 200);
  EXPECT_EQ(accepted.body, "picture");
}

}  // namespace
}  // namespace lightwell::test
