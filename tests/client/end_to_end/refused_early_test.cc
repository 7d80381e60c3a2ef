// Who cannot upload is told why at once: by the wrong protocol, or without the right.
#include <memory>
#include <string>
#include <vector>

#include "client/cli/command_line/exit_code.h"
#include "tests/client/end_to_end/end_to_end_fixture.h"
#include "tests/server/net/test_certificates.h"

namespace atlas {
namespace {

class RefusedEarlyTest : public EndToEndTest {
 protected:
  void SetUp() override {
    certificates_ = shared_root / "certificates";
    fs::create_directories(certificates_);
    authority_ = std::make_unique<TestAuthority>(certificates_, "test authority");
    const CertificateFiles files = authority_->Issue("localhost");
    with_tls_ = kSmall;
    with_tls_.insert(with_tls_.end(),
                     {"--tls-certificate", files.certificate.string(), "--tls-key",
                      files.key.string(), "--tls-client-ca", authority_->certificate().string()});
  }
  std::vector<std::string> By(const std::string& name) const {
    const CertificateFiles files = authority_->Issue(name);
    return {
        "--tls-ca",          authority_->certificate().string(), "--tls-name", "localhost",
        "--tls-certificate", files.certificate.string(),         "--tls-key",  files.key.string()};
  }
  // Reading its scans would end with kInvalidData.
  static fs::path DriveWithABadScan() {
    const fs::path drive = shared_root / "bad_drive";
    fs::copy(shared_drive, drive,
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    fs::resize_file(drive / "velodyne" / "000003.bin", 7);
    return drive;
  }
  static CommandRun IngestBad(const DaemonProcess& daemon, std::vector<std::string> more) {
    more.insert(more.begin(), {"ingest", DriveWithABadScan().string()});
    return RunAtlas(daemon.address(), more);
  }

  fs::path certificates_;
  std::unique_ptr<TestAuthority> authority_;
  std::vector<std::string> with_tls_;  // a daemon's flags
};

TEST_F(RefusedEarlyTest, WhoDoesNotSpeakTlsToADaemonThatDoesIsTold) {
  const DaemonProcess daemon(NewData(), with_tls_);
  const CommandRun run = RunAtlas(daemon.address(), {"status"});
  EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kUnavailable));
  EXPECT_NE(run.err.find("may expect TLS (--tls-ca)"), std::string::npos) << run.err;
}

TEST_F(RefusedEarlyTest, AndWhoSpeaksTlsToOneThatDoesNot) {
  const DaemonProcess daemon(NewData(), kSmall);
  const CommandRun run =
      RunAtlas(daemon.address(), {"status", "--tls-ca", authority_->certificate().string()});
  EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kUnavailable));
  EXPECT_NE(run.err.find("may not speak TLS"), std::string::npos) << run.err;
}

TEST_F(RefusedEarlyTest, ADaemonThatIsNotBelievedSpeaksIt) {
  const DaemonProcess daemon(NewData(), with_tls_);
  const CommandRun run = RunAtlas(daemon.address(), {"status", "--tls-name", "another", "--tls-ca",
                                                     authority_->certificate().string()});
  EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kUnavailable));
  EXPECT_EQ(run.err.find("may not speak TLS"), std::string::npos) << run.err;
}

TEST_F(RefusedEarlyTest, AReaderIsToldBeforeItsScansAreRead) {
  std::vector<std::string> flags = kSmall;
  flags.insert(flags.end(), {"--anonymous", "reader"});
  const DaemonProcess daemon(NewData(), flags);
  const CommandRun run = IngestBad(daemon, {});
  EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kFailure)) << run.err;
  EXPECT_NE(run.err.find("with the role reader, may not upload keyframes"), std::string::npos)
      << run.err;
}

TEST_F(RefusedEarlyTest, SoIsAVehicleUnderAnotherName) {
  const DaemonProcess daemon(NewData(), with_tls_);
  const CommandRun other = IngestBad(daemon, By("car-7"));
  EXPECT_EQ(other.exit_code, static_cast<int>(ExitCode::kFailure)) << other.err;
  EXPECT_NE(other.err.find("car-7, with the role vehicle, may not upload for the vehicle vehicle"),
            std::string::npos)
      << other.err;
  const CommandRun own = IngestBad(daemon, By("vehicle"));
  EXPECT_EQ(own.exit_code, static_cast<int>(ExitCode::kInvalidData)) << own.err;
}

}  // namespace
}  // namespace atlas
