// What is counted of a request, and what the log has of it.
#include "server/net/requests/request_record.h"

#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include "server/base/log_format.h"

namespace atlas {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

class RequestRecordTest : public testing::Test {
 protected:
  RequestRecordTest() : before_(spdlog::default_logger()) {
    const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(log_);
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("atlasd", sink));
    spdlog::set_formatter(MakeLogFormatter(LogFormat::kJson));
  }
  ~RequestRecordTest() override { spdlog::set_default_logger(before_); }

  static wire::Envelope StatusOf(std::uint64_t request_id) {
    wire::Envelope request;
    request.set_request_id(request_id);
    request.mutable_status_request();
    return request;
  }
  std::uint64_t Counted(RequestKind kind, StatusCode code) const {
    return counters_.kinds[static_cast<std::size_t>(kind)]
        .requests[static_cast<std::size_t>(code)]
        .value();
  }
  std::string log() const { return log_.str(); }

  NetCounters counters_;
  PeerLines lines_{2};
  PeerRecord peer_{"1.2.3.4:5", "", "", counters_, lines_, std::chrono::hours(1)};

 private:
  std::ostringstream log_;
  std::shared_ptr<spdlog::logger> before_;
};

TEST_F(RequestRecordTest, WhatGoesWellIsCountedAndNotInTheLog) {
  RequestRecord record(peer_, StatusOf(1));
  EXPECT_EQ(counters_.in_flight.value(), 1u);
  record.End({});
  EXPECT_EQ(counters_.in_flight.value(), 0u);
  EXPECT_EQ(Counted(RequestKind::kStatus, StatusCode::kOk), 1u);
  EXPECT_EQ(log(), "");
}

TEST_F(RequestRecordTest, AFailureIsInTheLogWithItsIds) {
  peer_.client = "demo\"\n";
  peer_.name = "car.7";
  RequestRecord(peer_, StatusOf(77)).End(Status(StatusCode::kNotFound, "it is \"gone\""));
  EXPECT_EQ(Counted(RequestKind::kStatus, StatusCode::kNotFound), 1u);
  EXPECT_THAT(log(), HasSubstr(R"("level":"info")"));
  EXPECT_THAT(log(),
              HasSubstr(R"("message":"request 77 (status) failed: not_found: it is \"gone\"")"));
  EXPECT_THAT(log(),
              HasSubstr(R"("peer":"1.2.3.4:5","client":"demo\"\u000a","name":"car.7",)"
                        R"("request_id":77,"kind":"status","code":"not_found","duration_ms":)"));
  EXPECT_THAT(log(), EndsWith("}\n"));
}

TEST_F(RequestRecordTest, ASlowOneIsInTheLogAndAWaitIsNot) {
  peer_.slow_request = std::chrono::milliseconds(-1);  // everything is
  wire::Envelope wait;
  wait.mutable_wait_request();
  RequestRecord(peer_, wait).End({});
  wire::Envelope query;
  query.mutable_query_region()->set_wait_revision(3);
  RequestRecord(peer_, query).End({});
  EXPECT_EQ(log(), "");
  RequestRecord(peer_, StatusOf(5)).End({});
  EXPECT_THAT(log(), HasSubstr(R"("message":"request 5 (status) took 0 ms")"));
  EXPECT_THAT(log(), HasSubstr(R"("code":"ok","duration_ms":0)"));
}

TEST_F(RequestRecordTest, ManyFailuresDoNotFillTheDisk) {
  for (std::uint64_t id = 0; id < 100; ++id) {
    RequestRecord(peer_, StatusOf(id)).End(Status(StatusCode::kNotFound, "gone"));
  }
  EXPECT_EQ(Counted(RequestKind::kStatus, StatusCode::kNotFound), 100u);
  EXPECT_THAT(log(), HasSubstr("request 1 "));
  EXPECT_LT(log().size(), 100u * 50u);
}

TEST_F(RequestRecordTest, NeitherDoConnectionsThatBreak) {
  for (int i = 0; i < 100; ++i) {
    peer_.Warn("frame: wrong magic");
  }
  EXPECT_THAT(log(), HasSubstr(R"("level":"warning","message":"frame: wrong magic","peer":)"));
  EXPECT_LT(log().size(), 100u * 50u);
  RequestRecord(peer_, StatusOf(1)).End(Status(StatusCode::kNotFound, "gone"));
  EXPECT_THAT(log(), HasSubstr("request 1 ")) << "these have lines of their own";
}

TEST_F(RequestRecordTest, OneLeftByAnExceptionIsAMistakeOfTheDaemon) {
  { const RequestRecord record(peer_, StatusOf(1)); }
  EXPECT_EQ(Counted(RequestKind::kStatus, StatusCode::kInternal), 1u);
  EXPECT_EQ(counters_.in_flight.value(), 0u);
}

TEST_F(RequestRecordTest, OneThatGoesOnElsewhereCountsOnce) {
  {
    RequestRecord record(peer_, StatusOf(1));
    RequestRecord moved(std::move(record));
    moved.End({});
    moved.End({});
  }
  EXPECT_EQ(Counted(RequestKind::kStatus, StatusCode::kOk), 1u);
  EXPECT_EQ(Counted(RequestKind::kStatus, StatusCode::kInternal), 0u);
  EXPECT_EQ(counters_.in_flight.value(), 0u);
}

}  // namespace
}  // namespace atlas
