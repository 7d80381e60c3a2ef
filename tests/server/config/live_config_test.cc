// Settings that change while the daemon runs: all or nothing.
#include "server/config/live_config.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace atlas {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class LiveConfigTest : public testing::Test {
 protected:
  LiveConfig Start(std::vector<std::string> arguments) {
    arguments_ = std::move(arguments);
    LiveConfig config(Read().value(), [this] { return Read(); });
    config.AddPart([this](const DaemonConfig& wanted) { return Prepare(wanted); });
    return config;
  }
  Result<DaemonCommand> Read() const {
    std::vector<const char*> argv = {"atlasd", "--data", "/x"};
    for (const std::string& argument : arguments_) {
      argv.push_back(argument.c_str());
    }
    return ParseDaemonCommand(static_cast<int>(argv.size()), argv.data());
  }
  Result<LiveConfig::Commit> Prepare(const DaemonConfig& wanted) {
    if (!part_status_.ok()) {
      return Error(part_status_);
    }
    return [this, wanted] {
      committed_.push_back(wanted.log_level);
    };
  }

  std::vector<std::string> arguments_;
  Status part_status_;
  std::vector<std::string> committed_;
};

TEST_F(LiveConfigTest, WhatCanChangeDoesAndTheRestIsNamed) {
  LiveConfig config = Start({"--workers", "2"});
  arguments_ = {"--workers", "3", "--log-level", "debug", "--cell-size", "0.2"};
  const auto outcome = config.Reload();
  ASSERT_TRUE(outcome.has_value()) << outcome.error().message();
  EXPECT_THAT(outcome->changed, ElementsAre("log_level"));
  EXPECT_THAT(outcome->waiting, ElementsAre("map.cell_size", "workers"));
  EXPECT_EQ(config.config().log_level, "debug");
  EXPECT_EQ(config.config().workers, 2);
  EXPECT_THAT(committed_, ElementsAre("debug"));
}

TEST_F(LiveConfigTest, WhatIsSaidInOtherWordsIsNoChange) {
  LiveConfig config = Start({"--cell-size", "0.2", "--log-level", "info"});
  arguments_ = {"--cell-size", "0.20", "--listen", "127.0.0.1:7447"};
  const auto outcome = config.Reload();
  ASSERT_TRUE(outcome.has_value());
  EXPECT_THAT(outcome->changed, IsEmpty());
  EXPECT_THAT(outcome->waiting, IsEmpty());
  EXPECT_THAT(committed_, ElementsAre("info"));  // files that settings name may have changed
}

TEST_F(LiveConfigTest, SettingsThatNeedEachOtherChangeTogether) {
  LiveConfig config = Start({"--tls-certificate", "a.pem", "--tls-key", "a.key"});
  arguments_ = {"--tls-certificate", "b.pem", "--tls-key", "b.key", "--tls-client-ca", "ca.pem"};
  const auto outcome = config.Reload();
  ASSERT_TRUE(outcome.has_value()) << outcome.error().message();
  EXPECT_THAT(outcome->changed, ElementsAre("tls.certificate", "tls.client_ca", "tls.key"));
  EXPECT_EQ(config.config().tls_certificate, "b.pem");
  EXPECT_EQ(config.config().tls_key, "b.key");
  EXPECT_EQ(config.config().tls_client_ca, "ca.pem");
}

TEST_F(LiveConfigTest, HowMuchMayBeStoredChanges) {
  LiveConfig config = Start({"--store-mib", "100"});
  arguments_ = {"--vehicle-mib", "7", "--disk-floor-mib", "0", "--compact", "true"};
  EXPECT_THAT(config.Reload()->changed,
              ElementsAre("retention.compact", "retention.disk_floor_mib", "retention.store_mib",
                          "retention.vehicle_mib"));
  EXPECT_EQ(config.config().store_mib, 0);
  EXPECT_EQ(config.config().vehicle_mib, 7);
  EXPECT_EQ(config.config().disk_floor_mib, 0);
  EXPECT_TRUE(config.config().is_compacting);
}

TEST_F(LiveConfigTest, ASettingThatIsGoneHasItsDefaultAgain) {
  LiveConfig config = Start({"--log-level", "error", "--log-format", "json"});
  arguments_ = {};
  EXPECT_THAT(config.Reload()->changed, ElementsAre("log_format", "log_level"));
  EXPECT_EQ(config.config().log_level, "info");
  EXPECT_EQ(config.config().log_format, "text");
}

TEST_F(LiveConfigTest, OneThatWaitsForARestartIsNamedUntilItIsBack) {
  LiveConfig config = Start({"--workers", "2"});
  arguments_ = {"--workers", "3"};
  EXPECT_THAT(config.Reload()->waiting, ElementsAre("workers"));
  EXPECT_THAT(config.Reload()->waiting, ElementsAre("workers"));
  arguments_ = {"--workers", "2"};
  EXPECT_THAT(config.Reload()->waiting, IsEmpty());
}

TEST_F(LiveConfigTest, FilesWithOtherContentAreNamed) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("live_config." + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const auto write = [&folder](const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return (folder / name).string();
  };
  const std::vector<std::string> given = {
      "--tls-certificate", write("a.pem", std::string(9'000, 'a')),
      "--tls-key",         write("a.key", "a"),
      "--tokens",          write("tokens", "")};
  LiveConfig config = Start(given);
  EXPECT_THAT(config.Reload()->renewed, IsEmpty());

  write("a.pem", std::string(8'999, 'a') + "b");
  write("tokens", "# nobody");
  part_status_ = Status(StatusCode::kInvalidData, "of no use");
  EXPECT_FALSE(config.Reload());
  part_status_ = {};
  const auto outcome = config.Reload();
  ASSERT_TRUE(outcome) << outcome.error().message();
  EXPECT_THAT(outcome->changed, IsEmpty());
  EXPECT_THAT(outcome->renewed, ElementsAre("access.tokens", "tls.certificate"));
  EXPECT_THAT(config.Reload()->renewed, IsEmpty()) << "once";

  write("a.key", "b");
  arguments_[1] = write("b.pem", "b");
  const auto renamed = config.Reload();
  ASSERT_TRUE(renamed) << renamed.error().message();
  EXPECT_THAT(renamed->changed, ElementsAre("tls.certificate"));
  EXPECT_THAT(renamed->renewed, ElementsAre("tls.key"));
  std::filesystem::remove_all(folder);
}

TEST_F(LiveConfigTest, AMistakeLeavesEverythingAsItWas) {
  LiveConfig config = Start({"--log-level", "debug"});
  const std::vector<std::vector<std::string>> mistakes = {{"--log-level", "loud"},
                                                          {"--log-format", "xml"},
                                                          {"--segments", "3"},
                                                          {"--config", "/nowhere.toml"}};
  for (const auto& mistake : mistakes) {
    arguments_ = mistake;
    const auto outcome = config.Reload();
    ASSERT_FALSE(outcome.has_value()) << mistake[0];
    EXPECT_EQ(config.config().log_level, "debug") << mistake[0];
  }
  EXPECT_THAT(committed_, IsEmpty());
}

TEST_F(LiveConfigTest, APartThatRefusesKeepsTheOthersFromChanging) {
  LiveConfig config = Start({});
  config.AddPart([](const DaemonConfig& /*wanted*/) -> Result<LiveConfig::Commit> {
    return Error(StatusCode::kInvalidData, "the certificate is damaged");
  });
  arguments_ = {"--log-level", "debug"};
  const auto outcome = config.Reload();
  ASSERT_FALSE(outcome.has_value());
  EXPECT_THAT(outcome.error().message(), HasSubstr("certificate"));
  EXPECT_EQ(config.config().log_level, "info");
  EXPECT_THAT(committed_, IsEmpty());
}

}  // namespace
}  // namespace atlas
