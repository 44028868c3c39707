// Claim: `graze drive --page` serves a page on this machine alone, under a name that nobody guesses; it gives frames as
// the robot goes, takes keys and sticks, and tells the end; the drive that is recorded is the same again.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <thread>

#include "engine/settings/settings.h"
#include "jobs/cli/drive_keys.h"
#include "jobs/cli/live_page.h"
#include "jobs/cli/page.h"
#include "tests/jobs/process.h"

namespace graze {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Address {
  explicit Address(const std::string& text) {
    std::smatch parts;
    const std::regex form("http://(127\\.0\\.0\\.1):([0-9]+)(/[0-9a-f]{16}/)");
    found = std::regex_search(text, parts, form);
    if (!found) return;
    host = parts[1];
    port = std::stoi(parts[2]);
    root = parts[3];
  }
  httplib::Client client() const { return httplib::Client(host, port); }
  bool found = false;
  std::string host, root;
  int port = 0;
};

/// Looks at frames until it is told to stop, or they end. Returns whether they ended.
bool listen(const Address& address, const std::function<bool(const json&)>& look) {
  httplib::Client client = address.client();
  std::string rest;
  bool goes_on = true;
  client.Get(address.root + "frames", [&](const char* bytes, std::size_t size) {
    rest.append(bytes, size);
    for (std::size_t end = rest.find("\n\n"); goes_on && end != std::string::npos; end = rest.find("\n\n")) {
      if (rest.starts_with("data: ")) goes_on = look(json::parse(rest.substr(6, end - 6)));
      rest.erase(0, end + 2);
    }
    return goes_on;
  });
  return goes_on;
}

struct DrivePage : ::testing::Test {
  void SetUp() override {
    if (page_template().head.empty()) GTEST_SKIP() << "built without pages";
  }
  testing::TemporaryFolder folder;
};

TEST_F(DrivePage, IsServedUnderItsNameAlone) {
  auto page = std::make_unique<LivePage>("{\"kind\": \"drive\"}", 0);
  const Address address(page->address());
  ASSERT_TRUE(address.found) << page->address();
  httplib::Client client = address.client();
  const auto whole = client.Get(address.root);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->status, 200);
  EXPECT_THAT(whole->body, AllOf(HasSubstr("{\"kind\": \"drive\"}"), HasSubstr("connect-src 'self'")));
  for (const std::string& path : {std::string("/"), std::string("/frames"), address.root + "../"}) {
    const auto other = client.Get(path);
    ASSERT_TRUE(other);
    EXPECT_EQ(other->status, 404) << path;
  }
  client.Post(address.root + "keys", "up", "text/plain");
  client.Post(address.root + "keys", "stick 0.5 0 -1", "text/plain");
  client.Post(address.root + "keys", std::string(1000, 'x'), "text/plain");
  client.Post("/keys", "down", "text/plain");
  const auto large = client.Post("/", std::string(1 << 20, 'x'), "text/plain");
  ASSERT_TRUE(large);
  EXPECT_EQ(large->status, 413) << "nobody's bytes are kept";
  EXPECT_THAT(page->pressed(), ElementsAre("up", "stick 0.5 0 -1"));
  EXPECT_THAT(page->pressed(), ElementsAre());
  try {
    const LivePage second("{}", static_cast<std::uint16_t>(address.port));
    ADD_FAILURE() << "a port of two programs";
  } catch (const MachineError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("--page: port"), HasSubstr("--page 0 takes one that is free")));
  }
  std::vector<int> seen;
  std::thread end([&] {
    page->show("{\"n\": 1}");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    page->show("{\"n\": 2}");
    page.reset();
  });
  EXPECT_TRUE(listen(address, [&](const json& frame) {
    seen.push_back(frame["n"]);
    return true;
  }));
  end.join();
  EXPECT_EQ(seen.back(), 2) << "the last frame is seen by all who look";
}

TEST_F(DrivePage, ShowsARobotThatIsSteeredThere) {
  const std::string scenario = testing::data("scenarios/quadruped_drive.yaml");
  testing::Process process(folder.path(), "drive " + scenario + " --page 0 --record way.csv",
                           [] { dup2(open("/dev/null", O_RDONLY), STDIN_FILENO); });
  process.wait_until([&] { return Address(process.err()).found; });
  const Address address(process.err());
  const auto page = address.client().Get(address.root);
  ASSERT_TRUE(page);
  EXPECT_THAT(page->body, AllOf(HasSubstr("\"kind\":\"drive\""), HasSubstr("\"policies\":[\"walk\",\"trot\"]")));
  double first = -1, last = -1, asked = 0;
  std::size_t rows = 0;
  std::string message;
  listen(address, [&](const json& frame) {
    if (first < 0) {
      first = frame["time"];
      address.client().Post(address.root + "keys", "up", "text/plain");
    }
    last = frame["time"];
    asked = std::max(asked, frame["command"][0].get<double>());
    rows = frame["bodies"]["poses"].size();
    message = frame["message"];
    if (asked > 0 && last > first + 0.3) address.client().Post(address.root + "keys", "q", "text/plain");
    return true;
  });
  const testing::Result end = process.wait();
  EXPECT_EQ(end.code, 0) << end.err;
  EXPECT_GT(last, first);
  EXPECT_EQ(asked, 0.05);
  EXPECT_EQ(rows, 7u * 13);
  EXPECT_THAT(message, HasSubstr("the drive has ended: "));
  std::smatch digest, time;
  ASSERT_TRUE(std::regex_search(end.out, digest, std::regex("digest ([0-9a-f]{16})"))) << end.out;
  ASSERT_TRUE(std::regex_search(end.out, time, std::regex("--set (time.end=[0-9.]+)"))) << end.out;
  const testing::Result again =
      testing::graze(folder.path(), "drive '" + scenario + "' --replay way.csv --set " + time[1].str());
  EXPECT_THAT(again.out, HasSubstr("digest " + digest[1].str()));
}

TEST_F(DrivePage, GoesWithoutAReplay) {
  const std::string scenario = "'" + testing::data("scenarios/quadruped_drive.yaml") + "'";
  testing::write_file(folder / "way.csv", "time,forward,strafe,turn\n0,0,0,0\n");
  const testing::Result both = testing::graze(folder.path(), "drive " + scenario + " --page 0 --replay way.csv");
  EXPECT_EQ(both.code, 2);
  EXPECT_THAT(both.err, HasSubstr("--page: a drive that is replayed is over at once"));
  EXPECT_THAT(testing::graze(folder.path(), "drive " + scenario + " --page 65536").err, HasSubstr("65535"));
}

TEST(DriveKeys, SticksLieBetweenTheMost) {
  DriveWheel wheel;
  wheel.steer(0.5, -1, 2);
  EXPECT_EQ(wheel.forward(), 0.5);
  EXPECT_EQ(wheel.strafe(), -1);
  EXPECT_EQ(wheel.turn(), 2) << "rad/s, a whole stick's";
  wheel.press("c");
  wheel.steer(1, 1, 0.5);
  EXPECT_EQ(wheel.strafe(), 0) << "a car does not strafe";
  EXPECT_EQ(wheel.turn(), 2) << "4/m at half of its stick, 1 m/s: half of the most curved";
}

}  // namespace
}  // namespace graze
