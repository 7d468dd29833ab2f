#include <algorithm>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/advertisement.hpp>
#include <lightwell/text.hpp>

namespace lightwell {
namespace {

using ::testing::HasSubstr;

Advertisement attic() {
  return {.name = "attic \xC3\xA9",
          .probe_id = 0x00ABCDEF,
          .calibration_id = 0xFFFFFFFF,
          .version = "0.1.0",
          .wire_version = 1,
          .links = {{"grpc://:7420", "none"}, {"mqtts://broker:8883/venue/attic", "tls"}}};
}

TEST(Advertisement, RoundTrips) {
  const Result<Advertisement> back = advertisement_from_txt(advertisement_to_txt(attic()));
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(*back, attic());
}

TEST(Advertisement, IgnoresUnknownKeysAndUsesTheFirstOfRepeatedKeys) {
  std::vector<std::string> txt = advertisement_to_txt(attic());
  txt.insert(txt.begin(), {"colour=red", "", "=", "nothing"});
  txt.push_back("name=impostor");
  const Result<Advertisement> back = advertisement_from_txt(txt);
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(back->name, attic().name);
}

TEST(Advertisement, RejectsInvalidRecordsNamingTheKey) {
  const auto refusal = [](const std::string& key, const std::string& value) {
    std::vector<std::string> txt = advertisement_to_txt(attic());
    const auto entry = std::ranges::find_if(txt, [&](const std::string& e) { return e.starts_with(key + "="); });
    *entry = key + "=" + value;
    const Result<Advertisement> read = advertisement_from_txt(txt);
    return read.ok() ? "taken" : read.status().message();
  };
  EXPECT_THAT(refusal("txtvers", "2"), HasSubstr("txtvers"));
  for (const std::string bad : {"", "12345", "0000000g", "123456789", "-1234567", "+1234567", "0x123456"})
    EXPECT_THAT(refusal("id", bad), HasSubstr("id:")) << bad;
  for (const std::string bad : {"", "0", "-1", "4294967296", "1 "})
    EXPECT_THAT(refusal("wire", bad), HasSubstr("wire")) << bad;
  for (const std::string& bad :
       {std::string(), std::string(65, 'a'), std::string("\x1b[2J"), std::string("a\nb"), std::string("a\0b", 3),
        std::string("\xFF\xFE"), std::string("\xC3"), std::string("\xC0\xAF"), std::string("\xED\xA0\x80"),
        std::string("\xE2\x80\xAE"
                    "citta"),
        std::string("\xC2\x9B"
                    "2J")})
    EXPECT_THAT(refusal("name", bad), HasSubstr("name")) << printable(bad);
  for (const std::string& bad : {std::string(), std::string(33, '1'), std::string("0.1;rm"), std::string("0.1\x07")})
    EXPECT_THAT(refusal("version", bad), HasSubstr("version")) << bad;
  for (const std::string bad : {"", "grpc", "://x", "grpc://", "gr pc://x", "GRPC://x", "grpc://x y", "grpc://x\x1b"})
    EXPECT_THAT(refusal("link0", bad), HasSubstr("link0")) << bad;
  EXPECT_THAT(refusal("sec1", "perhaps"), HasSubstr("sec1"));
  EXPECT_FALSE(advertisement_from_txt({}).ok());
  EXPECT_FALSE(advertisement_from_txt(std::vector<std::string>(65, "a=b")).ok());
}

TEST(Advertisement, RandomRecordsAreRejectedOrPrintable) {
  std::mt19937 random(7);
  for (int i = 0; i < 20'000; ++i) {
    std::vector<std::string> txt = advertisement_to_txt(attic());
    for (int k = 0; k < 3; ++k) {
      std::string& entry = txt[random() % txt.size()];
      if (!entry.empty()) entry[random() % entry.size()] = static_cast<char>(random());
    }
    const Result<Advertisement> read = advertisement_from_txt(txt);
    if (!read.ok()) continue;
    EXPECT_EQ(printable(read->name), read->name);
    EXPECT_EQ(printable(read->version), read->version);
    for (const AdvertisedLink& link : read->links) EXPECT_EQ(printable(link.uri), link.uri);
  }
}

TEST(Advertisement, AdvertisesLinksAsOtherMachinesReachThem) {
  EXPECT_EQ(advertised_link("grpc://0.0.0.0:7420"), (AdvertisedLink{"grpc://:7420", "none"}));
  EXPECT_EQ(advertised_link("grpcs://[::]:7420"), (AdvertisedLink{"grpcs://:7420", "tls"}));
  EXPECT_EQ(advertised_link("grpc://10.0.0.7:7420"), (AdvertisedLink{"grpc://10.0.0.7:7420", "none"}));
  EXPECT_EQ(advertised_link("ws://10.0.0.7:7443"), (AdvertisedLink{"ws://10.0.0.7:7443", "none"}));
  EXPECT_EQ(advertised_link("wss://[::]:7443"), (AdvertisedLink{"wss://:7443", "tls"}));
  EXPECT_EQ(advertised_link("mqtts://broker:8883/a"), (AdvertisedLink{"mqtts://broker:8883/a", "tls"}));
  for (const char* nobody_else : {"grpc://127.0.0.1:7420", "grpc://[::1]:7420", "grpc://localhost:1", "usb"})
    EXPECT_EQ(advertised_link(nobody_else).uri, "") << nobody_else;
}

TEST(Advertisement, OmitsALinkThatDoesNotFit) {
  Advertisement a = attic();
  a.links = {{"mqtt://" + std::string(250, 'b') + ":1883/a", "none"}, {"grpc://:7420", "none"}};
  const std::vector<std::string> txt = advertisement_to_txt(a);
  for (const std::string& entry : txt) EXPECT_LE(entry.size(), 255U);
  const Result<Advertisement> back = advertisement_from_txt(txt);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->links, (std::vector<AdvertisedLink>{{"grpc://:7420", "none"}}));
}

TEST(Printable, KeepsLettersAndEscapesTheRest) {
  EXPECT_EQ(printable("caf\xC3\xA9 \xE2\x82\xAC"), "caf\xC3\xA9 \xE2\x82\xAC");
  EXPECT_EQ(printable("\x1b[31m"), "\\x1b[31m");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\xFF"), "\\xff");
  EXPECT_EQ(printable("\xE2\x82"), "\\xe2\\x82");
  EXPECT_EQ(printable("ann\n<3>lightwelld: error"), "ann\\x0a<3>lightwelld: error");
  EXPECT_EQ(printable("\x1b[2J\x7f\xC2\x9B"), "\\x1b[2J\\x7f\\xc2\\x9b");
  for (const char* mark : {"\u202E", "\u2066", "\u200F", "\u061C", "\u2028"})
    EXPECT_EQ(printable(mark).front(), '\\') << printable(mark);
  EXPECT_EQ(printable("\u0627\u4E2D\U0001F600"), "\u0627\u4E2D\U0001F600") << "letters of any language stay";
}

}  // namespace
}  // namespace lightwell
