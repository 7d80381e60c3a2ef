// Who may come in, from where, and how much of the daemon one name may have.
#include <string>
#include <vector>

#include "tests/server/config/config_fixture.h"

namespace atlas {
namespace {

using testing::AllOf;
using testing::HasSubstr;

using AccessConfigTest = DaemonConfigTest;

TEST_F(AccessConfigTest, InTheClearOnlyLoopbackIsListenedOn) {
  for (const char* address : {"0.0.0.0:7447", "192.168.1.1:7447", "[::]:7447", "example:7447"}) {
    EXPECT_THAT(
        Refusal({"--data", "/x", "--listen", address}),
        AllOf(HasSubstr("--listen"), HasSubstr(address), HasSubstr("loopback"), HasSubstr("TLS")));
  }
  EXPECT_THAT(RefusedFile("data = '/x'\nlisten = '10.0.0.1:7447'\n"),
              AllOf(HasSubstr("line 2"), HasSubstr("loopback")));
  for (const char* address : {"127.0.0.1:0", "127.1.2.3:1", "localhost:7447", "[::1]:7447"}) {
    EXPECT_TRUE(Parse({"--data", "/x", "--listen", address}).has_value()) << address;
  }
}

TEST_F(AccessConfigTest, BeyondLoopbackItTakesTlsOrToBeTold) {
  const std::vector<std::string> tls = {"--tls-certificate", "c.pem", "--tls-key", "k.pem"};
  const std::vector<std::string> beyond = {"--data", "/x", "--listen", "0.0.0.0:7447"};
  const auto with = [](std::vector<std::string> all, const std::vector<std::string>& more) {
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  EXPECT_THAT(Refusal(with(beyond, tls)), HasSubstr("nobody could come in"));
  const auto vehicles = Parse(with(with(beyond, tls), {"--tls-client-ca", "ca.pem"}));
  ASSERT_TRUE(vehicles.has_value()) << vehicles.error().message();
  EXPECT_EQ(vehicles->config.AnonymousRole(), "none");
  EXPECT_TRUE(Parse(with(with(beyond, tls), {"--tokens", "tokens.txt"})).has_value());
  EXPECT_TRUE(Parse(with(with(beyond, tls), {"--anonymous", "reader"})).has_value());
  EXPECT_TRUE(
      Parse(with(beyond, {"--allow-plaintext", "true", "--anonymous", "reader"})).has_value());
  EXPECT_THAT(Refusal(with(beyond, {"--allow-plaintext", "true"})),
              HasSubstr("nobody could come in"));
  EXPECT_THAT(Refusal(with(beyond, {"--allow-plaintext", "perhaps"})), HasSubstr("true or false"));
}

TEST_F(AccessConfigTest, OnThisMachineWhoeverComesIsAdminUntilSomethingIsExpected) {
  EXPECT_EQ(Parse({"--data", "/x"})->config.AnonymousRole(), "admin");
  EXPECT_EQ(Parse({"--data", "/x", "--tokens", "t"})->config.AnonymousRole(), "none");
  EXPECT_EQ(
      Parse({"--data", "/x", "--tokens", "t", "--anonymous", "reader"})->config.AnonymousRole(),
      "reader");
}

TEST_F(AccessConfigTest, HalvesOfTlsAreRefused) {
  EXPECT_THAT(Refusal({"--data", "/x", "--tls-certificate", "c"}), HasSubstr("tls.key"));
  EXPECT_THAT(Refusal({"--data", "/x", "--tls-key", "k"}), HasSubstr("tls.certificate"));
  EXPECT_THAT(Refusal({"--data", "/x", "--tls-client-ca", "a"}), HasSubstr("tls.client_ca"));
}

TEST_F(AccessConfigTest, WhatANameMayHaveIsRead) {
  const auto read = Parse({"--config", File("data = '/x'\n[limits]\nconnections_per_name = 7\n"
                                            "held_mib_per_name = 50\nmib_per_s_per_name = 0\n"
                                            "served_mib_per_s_per_name = 3\n"
                                            "requests_per_s_per_name = 9\n"
                                            "sessions_per_hour_per_vehicle = 0\n")});
  ASSERT_TRUE(read.has_value()) << read.error().message();
  EXPECT_EQ(read->config.name_connections, 7);
  EXPECT_EQ(read->config.name_held_mib, 50);
  EXPECT_EQ(read->config.name_mib_per_s, 0);
  EXPECT_EQ(read->config.name_served_mib_per_s, 3);
  EXPECT_EQ(read->config.name_requests_per_s, 9);
  EXPECT_EQ(read->config.vehicle_sessions_per_hour, 0);
  EXPECT_TRUE(IsLiveSetting("limits.sessions_per_hour_per_vehicle"));
  EXPECT_THAT(Refusal({"--data", "/x", "--connections-per-name", "0"}),
              HasSubstr("limits.connections_per_name is '0'"));
  EXPECT_TRUE(IsLiveSetting("limits.connections_per_name"));
}

}  // namespace
}  // namespace atlas
