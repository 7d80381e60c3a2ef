// Where settings come from, which goes before which, and what a mistake says.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/server/config/config_fixture.h"

namespace atlas {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST_F(DaemonConfigTest, DefaultsNeedOnlyADirectory) {
  const auto command = Parse({"--data", "/x"});
  ASSERT_TRUE(command.has_value()) << command.error().message();
  const DaemonConfig& config = command->config;
  EXPECT_EQ(config.data, "/x");
  EXPECT_EQ(config.host, "127.0.0.1");
  EXPECT_EQ(config.port, 7447);
  EXPECT_EQ(config.workers, 0);
  EXPECT_EQ(config.cache_mib, 512);
  EXPECT_EQ(config.survey_mib, 1024);
  EXPECT_EQ(config.survey_disk_mib, 4096);
  EXPECT_EQ(config.scrub_kib_per_s, 2048);
  EXPECT_EQ(config.scrub_hours, 24);
  EXPECT_EQ(config.store_mib, 0);
  EXPECT_EQ(config.vehicle_mib, 0);
  EXPECT_EQ(config.disk_floor_mib, 256);
  EXPECT_FALSE(config.is_compacting);
  EXPECT_EQ(config.log_level, "info");
  EXPECT_EQ(config.NewProfile().value(), MapProfile());
  EXPECT_THAT(Refusal({}), HasSubstr("--data"));
}

TEST_F(DaemonConfigTest, FlagsGoBeforeEnvironmentBeforeFileBeforeDefault) {
  const std::string file = File(
      "data = '/file'\nworkers = 1\ncache_mib = 9\nsurvey_mib = 0\nsurvey_disk_mib = 7\nlisten = "
      "'127.0.0.1:1'\nlog_level = 'error'\n"
      "[map]\ncell_size = 0.2\nsegments = 4\nsegment_height = 0.5\npreset = 'strict'\n");
  SetVariable("ATLASD_WORKERS", "2");
  SetVariable("ATLASD_LISTEN", "127.0.0.1:2");
  SetVariable("ATLASD_SEGMENTS", "16");
  const auto command = Parse({"--config", file, "--listen", "[::1]:3", "--segments", "8"});
  ASSERT_TRUE(command.has_value()) << command.error().message();
  const DaemonConfig& config = command->config;
  EXPECT_EQ(config.data, "/file");
  EXPECT_EQ(config.cache_mib, 9);
  EXPECT_EQ(config.survey_mib, 0);
  EXPECT_EQ(config.survey_disk_mib, 7);
  EXPECT_EQ(config.log_level, "error");
  EXPECT_EQ(config.workers, 2);
  EXPECT_EQ(config.host, "::1");
  EXPECT_EQ(config.port, 3);
  const MapProfile profile = config.NewProfile().value();
  EXPECT_EQ(profile.cell_size_um, 200'000u);
  EXPECT_EQ(profile.column_segments, 8);
  EXPECT_EQ(profile.segment_height_mm, 500);
}

TEST_F(DaemonConfigTest, WhatPutsASessionIntoQuarantineCanBeSet) {
  const auto limits = [](const DaemonConfig& config) {
    return std::vector<int>{config.quarantine_speed_mps, config.quarantine_jump_m,
                            config.quarantine_climb_mps, config.quarantine_height_jump_m};
  };
  const auto usual = Parse({"--data", "/x"});
  ASSERT_TRUE(usual.has_value()) << usual.error().message();
  EXPECT_EQ(limits(usual->config), (std::vector<int>{90, 50, 15, 10}));
  const auto other = Parse({"--config", File("data = '/x'\n[quarantine]\nmax_speed_mps = 0\n"
                                             "max_jump_m = 1\nmax_climb_mps = 2\n"
                                             "max_height_jump_m = 3\n")});
  ASSERT_TRUE(other.has_value()) << other.error().message();
  EXPECT_EQ(limits(other->config), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_THAT(Refusal({"--data", "/x", "--quarantine-max-climb-mps", "-1"}),
              HasSubstr("quarantine.max_climb_mps"));
}

TEST_F(DaemonConfigTest, AnUnknownKeyIsAnErrorWithItsLine) {
  EXPECT_THAT(RefusedFile("data = '/x'\n\nworker = 3\n"),
              HasSubstr("atlasd.toml: line 3: unknown key 'worker'"));
  EXPECT_THAT(RefusedFile("data = '/x'\n[map]\ncell = 3\n"),
              HasSubstr("line 3: unknown key 'map.cell'"));
  EXPECT_THAT(RefusedFile("data = '/x'\n[nothing]\nx = 1\n"),
              HasSubstr("line 2: unknown key 'nothing'"));
  EXPECT_THAT(RefusedFile("data = '/x'\n[map]\n[map.deep]\nx = 1\n"),
              HasSubstr("unknown key 'map.deep'"));
}

TEST_F(DaemonConfigTest, AnUnknownVariableIsAnErrorAndThoseOfOthersAreNot) {
  SetVariable("ATLASD_WORKER", "3");
  EXPECT_EQ(Refusal({"--data", "/x"}), "environment: unknown variable 'ATLASD_WORKER'");
  EXPECT_EQ(Refusal({"--data", "/x", "--workers", "2"}),
            "environment: unknown variable 'ATLASD_WORKER'");
  ::unsetenv("ATLASD_WORKER");
  SetVariable("ATLAS_SERVER", "127.0.0.1:1");
  SetVariable("ATLASDAEMON", "3");
  SetVariable("ATLASD_BACKUP_FOLDER", "/y=z");
  const auto command = Parse({"--data", "/x"});
  ASSERT_TRUE(command.has_value()) << command.error().message();
  EXPECT_EQ(command->config.backup_folder, "/y=z");
}

TEST_F(DaemonConfigTest, AFolderIsNoConfigurationFile) {
  EXPECT_THAT(Refusal({"--config", std::filesystem::temp_directory_path().string()}),
              HasSubstr("is a folder"));
}

// Brackets, and keys of tables within tables: as many as there is room for, and more.
TEST_F(DaemonConfigTest, AFileHoweverDeepIsRefused) {
  const auto repeated = [](std::string_view text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) {
      all += text;
    }
    return all;
  };
  EXPECT_THAT(RefusedFile("x = " + repeated("[", 8'000)), HasSubstr("line 1"));
  EXPECT_THAT(RefusedFile("x" + repeated(".x", 8'000) + " = 1"), HasSubstr("unknown key 'x'"));
  for (const int deep : {16'000, 100'000}) {
    EXPECT_THAT(RefusedFile("x" + repeated(".x", deep) + " = 1"),
                HasSubstr("bytes, expected at most 16384"));
    EXPECT_THAT(RefusedFile("[x" + repeated(".x", deep) + "]"),
                HasSubstr("bytes, expected at most 16384"));
  }
}

TEST_F(DaemonConfigTest, AValueOfAnotherTypeIsAnErrorWithItsLine) {
  EXPECT_THAT(RefusedFile("data = '/x'\nworkers = '3'\n"),
              HasSubstr("line 2: 'workers': expected a number"));
  EXPECT_THAT(RefusedFile("data = 7\n"), HasSubstr("line 1: 'data': expected a text"));
  EXPECT_THAT(RefusedFile("data = ['/x']\n"), HasSubstr("line 1: 'data': expected a text"));
  EXPECT_THAT(RefusedFile("data = '/x'\nlisten = 7447\n"), HasSubstr("line 2: 'listen'"));
  EXPECT_THAT(RefusedFile("data = '/x'\ncache_mib = true\n"), HasSubstr("line 2: 'cache_mib'"));
  EXPECT_THAT(RefusedFile("data = '/x'\nmap = 3\n"), HasSubstr("line 2: unknown key 'map'"));
}

TEST_F(DaemonConfigTest, AValueOutOfRangeNamesWhereItWasGiven) {
  EXPECT_THAT(RefusedFile("data = '/x'\nworkers = 65\n"),
              AllOf(HasSubstr("line 2: workers is '65'"), HasSubstr("0 to 64")));
  EXPECT_THAT(RefusedFile("data = '/x'\nworkers = 1.5\n"), HasSubstr("line 2"));
  EXPECT_THAT(RefusedFile("data = '/x'\ncache_mib = 7\n"), HasSubstr("line 2: cache_mib is '7'"));
  EXPECT_THAT(RefusedFile("data = '/x'\nqueue_mib = 7\n"), HasSubstr("line 2: queue_mib is '7'"));
  EXPECT_THAT(Refusal({"--data", "/x", "--workers", "-1"}),
              HasSubstr("--workers: workers is '-1'"));
  SetVariable("ATLASD_WORKERS", "many");
  EXPECT_THAT(Refusal({"--data", "/x"}), HasSubstr("ATLASD_WORKERS: workers is 'many'"));
}

TEST_F(DaemonConfigTest, MalformedTomlIsAnErrorWithItsLine) {
  EXPECT_THAT(RefusedFile("data = '/x'\nworkers = = 3\n"), HasSubstr("atlasd.toml: line 2"));
  EXPECT_THAT(RefusedFile("data = '/x\n"), HasSubstr("line 1"));
  EXPECT_THAT(RefusedFile("data = '/x'\ndata = '/y'\n"), HasSubstr("line 2"));
}

TEST_F(DaemonConfigTest, TablesOfTheFileAreRead) {
  const auto read = Parse(
      {"--config", File("data = '/x'\n[tls]\ncertificate = 'c'\nkey = 'k'\nclient_ca = 'a'\n"
                        "[access]\ntokens = 't'\nanonymous = 'reader'\nallow_plaintext = true\n")});
  ASSERT_TRUE(read.has_value()) << read.error().message();
  EXPECT_EQ(read->config.tls_key, "k");
  EXPECT_EQ(read->config.tls_client_ca, "a");
  EXPECT_EQ(read->config.tokens, "t");
  EXPECT_TRUE(read->config.allow_plaintext);
  EXPECT_THAT(RefusedFile("data = '/x'\n[access]\nallow_plaintext = 1\n"),
              HasSubstr("true or false"));
}

TEST_F(DaemonConfigTest, FusionMayStandBackOrStandStill) {
  const auto given = Parse({"--data", "/x"});
  EXPECT_TRUE(given->config.is_fusing);
  EXPECT_EQ(given->config.fusion_nice, DaemonConfig().fusion_nice);
  const auto read = Parse({"--config", File("data = '/x'\n[fusion]\nenabled = false\nnice = 3\n")});
  ASSERT_TRUE(read.has_value()) << read.error().message();
  EXPECT_FALSE(read->config.is_fusing);
  EXPECT_EQ(read->config.fusion_nice, 3);
  EXPECT_THAT(Refusal({"--data", "/x", "--fusion-nice", "20"}), HasSubstr("from 0 to 19"));
}

TEST_F(DaemonConfigTest, TheOperationsPortIsOffUnlessItIsOfLoopback) {
  EXPECT_EQ(Parse({"--data", "/x"})->config.http, std::nullopt);
  EXPECT_EQ(Parse({"--data", "/x", "--http", ""})->config.http, std::nullopt);
  EXPECT_EQ(Parse({"--data", "/x", "--http", "localhost:0"})->config.http,
            (HostPort{"127.0.0.1", 0}));
  EXPECT_EQ(Parse({"--data", "/x", "--http", "[::1]:9"})->config.http, (HostPort{"::1", 9}));
  for (const char* address : {"0.0.0.0:80", "10.0.0.1:80", "[::]:80", "example:80"}) {
    const auto command = Parse({"--data", "/x", "--http", address});
    ASSERT_FALSE(command.has_value()) << address;
    EXPECT_EQ(command.error().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(command.error().message(),
                AllOf(HasSubstr("--http"), HasSubstr(address), HasSubstr("loopback")));
  }
  EXPECT_THAT(RefusedFile("data = '/x'\nhttp = '10.0.0.1:80'\n"),
              AllOf(HasSubstr("line 2"), HasSubstr("loopback")));
  SetVariable("ATLASD_HTTP", "127.0.0.1:70000");
  EXPECT_THAT(Refusal({"--data", "/x"}), HasSubstr("ATLASD_HTTP: http is '127.0.0.1:70000'"));
}

TEST_F(DaemonConfigTest, TheLogIsTextOrJson) {
  EXPECT_EQ(Parse({"--data", "/x"})->config.log_format, "text");
  EXPECT_EQ(Parse({"--data", "/x", "--log-format", "json"})->config.log_format, "json");
  EXPECT_THAT(Refusal({"--data", "/x", "--log-format", "xml"}),
              HasSubstr("--log-format: log_format is 'xml', expected text or json"));
}

TEST_F(DaemonConfigTest, RefusesValuesThatMakeNoSense) {
  const std::vector<std::vector<std::string>> mistakes = {{"--cell-size", "0.1x"},
                                                          {"--segments", "3.5"},
                                                          {"--segment-height", "x"},
                                                          {"--listen", "7447"},
                                                          {"--listen", "h:70000"},
                                                          {"--listen", "127.0.0.1:"},
                                                          {"--listen", "127.0.0.1:-1"},
                                                          {"--log-level", "loud"},
                                                          {"--preset", "loose"},
                                                          {"--cache-mib", "9999999999"},
                                                          {"--workers", ""},
                                                          {"--workers"},
                                                          {"--nonsense"},
                                                          {"--data", "/y", "extra"}};
  for (std::vector<std::string> arguments : mistakes) {
    arguments.insert(arguments.begin(), {"--data", "/x"});
    EXPECT_NE(Refusal(arguments), "accepted") << arguments[2];
  }
}

TEST_F(DaemonConfigTest, AMapThatCannotBeIsRefusedByNameAndRange) {
  const std::map<std::string, std::pair<std::vector<std::string>, std::string>> mistakes = {
      {"--cell-size",
       {{"-0.1", "0", "nan", "1e300", "inf", "0.0199", "1.01"}, "metres from 0.02 to 1"}},
      {"--segments", {{"0", "1", "3", "300", "-8", "99999999999"}, "2, 4, 8 or 16"}},
      {"--segment-height", {{"0", "0.09", "4.1", "-1", "nan", "inf"}, "metres from 0.1 to 4"}}};
  for (const auto& [flag, mistake] : mistakes) {
    for (const std::string& value : mistake.first) {
      EXPECT_THAT(Refusal({"--data", "/x", flag, value}),
                  AllOf(HasSubstr(flag + ": map."), HasSubstr(" is '" + value + "'"),
                        HasSubstr("expected " + mistake.second)));
    }
  }
  const std::string file = File("[map]\npreset = 'paper'\nsegments = 0\n");
  EXPECT_THAT(Refusal({"--data", "/x", "--config", file}),
              AllOf(HasSubstr(file + ": line 3"), HasSubstr("map.segments is '0'")));
}

TEST_F(DaemonConfigTest, AMapAtTheEndsOfItsRangesIsTaken) {
  const std::vector<std::vector<std::string>> ends = {{"0.02", "2", "0.1"}, {"1", "16", "4"}};
  for (const auto& end : ends) {
    const auto command = Parse(
        {"--data", "/x", "--cell-size", end[0], "--segments", end[1], "--segment-height", end[2]});
    ASSERT_TRUE(command.has_value()) << command.error().message();
    EXPECT_TRUE(command->config.NewProfile().has_value()) << end[0];
  }
}

TEST_F(DaemonConfigTest, AMissingFileIsNotFound) {
  const auto command = Parse({"--config", "/nowhere.toml"});
  ASSERT_FALSE(command.has_value());
  EXPECT_EQ(command.error().code(), StatusCode::kNotFound);
  EXPECT_THAT(command.error().message(), HasSubstr("/nowhere.toml"));
}

TEST_F(DaemonConfigTest, HelpAndVersionArePrintedNotRefused) {
  const auto help = Parse({"--help"});
  ASSERT_TRUE(help.has_value());
  EXPECT_THAT(help->text.value(), HasSubstr("--segment-height"));
  const auto version = Parse({"--version"});
  ASSERT_TRUE(version.has_value());
  EXPECT_THAT(version->text.value(), HasSubstr("atlasd "));
}

// The brackets behind a flag's help: what it is when it is not given.
std::string DefaultInHelp(const std::string& help, const std::string& flag_and_value) {
  const std::size_t flag = help.find("  " + flag_and_value + " ");
  if (flag == std::string::npos) {
    return "no " + flag_and_value;
  }
  const std::size_t begin = help.find('[', flag) + 1;
  return help.substr(begin, help.find(']', begin) - begin);
}

TEST_F(DaemonConfigTest, HelpNamesTheDefaultsThatCount) {
  const std::string help = Parse({"--help"})->text.value();
  const DaemonConfig config;
  const MapProfile map = config.NewProfile().value();
  EXPECT_EQ(DefaultInHelp(help, "--data DIR"), "must be given");
  EXPECT_EQ(DefaultInHelp(help, "--listen HOST:PORT"),
            config.host + ":" + std::to_string(config.port));
  EXPECT_EQ(DefaultInHelp(help, "--workers N"), std::to_string(config.workers));
  EXPECT_EQ(DefaultInHelp(help, "--cache-mib MIB"), std::to_string(config.cache_mib));
  EXPECT_EQ(DefaultInHelp(help, "--survey-mib MIB"), std::to_string(config.survey_mib));
  EXPECT_EQ(DefaultInHelp(help, "--queue-mib MIB"), std::to_string(config.queue_mib));
  EXPECT_EQ(DefaultInHelp(help, "--scrub-kib-per-s KIB"), std::to_string(config.scrub_kib_per_s));
  EXPECT_EQ(DefaultInHelp(help, "--scrub-hours H"), std::to_string(config.scrub_hours));
  EXPECT_EQ(DefaultInHelp(help, "--survey-disk-mib MIB"), std::to_string(config.survey_disk_mib));
  EXPECT_EQ(DefaultInHelp(help, "--log-level LEVEL"), config.log_level);
  EXPECT_DOUBLE_EQ(std::stod(DefaultInHelp(help, "--cell-size M")), map.cell_size_m());
  EXPECT_EQ(DefaultInHelp(help, "--segments N"), std::to_string(map.column_segments));
  EXPECT_DOUBLE_EQ(std::stod(DefaultInHelp(help, "--segment-height M")), map.segment_height_m());
  EXPECT_EQ(DefaultInHelp(help, "--preset NAME"), FusionPresetName(map.preset));
  EXPECT_EQ(help.find("TEXT"), std::string::npos);
}

TEST_F(DaemonConfigTest, AnExistingMapIsKeptToUnlessNothingWasAsked) {
  MapProfile existing;
  existing.segment_height_mm = 500;
  EXPECT_TRUE(Parse({"--data", "/x"})->config.CheckAgainst(existing).ok());
  const auto same = Parse({"--data", "/x", "--segment-height", "0.5"});
  EXPECT_TRUE(same->config.CheckAgainst(existing).ok());
  const auto other = Parse({"--data", "/x", "--segment-height", "1"});
  const Status status = other->config.CheckAgainst(existing);
  EXPECT_EQ(status.code(), StatusCode::kInvalidData);
  EXPECT_THAT(status.message(), HasSubstr("segment height"));
}

}  // namespace
}  // namespace atlas
