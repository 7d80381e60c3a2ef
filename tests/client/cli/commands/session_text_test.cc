#include "client/cli/commands/drive/session_text.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "client/cli/output/json_text.h"

namespace atlas {
namespace {

LastingUploadReport ReportOf(const std::string& state, std::uint64_t others = 0) {
  UploadedSession session;
  session.summary.key = {"car", "monday"};
  session.summary.state = state;
  session.others = others;
  LastingUploadReport report;
  report.sessions.push_back(session);
  return report;
}

std::string NotesOf(const LastingUploadReport& report) {
  std::ostringstream out;
  PrintSessionNotes(report, out);
  return out.str();
}

TEST(SessionTextTest, OfASessionInTheMapNothingIsSaid) {
  EXPECT_EQ(NotesOf(ReportOf("live")), "");
  EXPECT_EQ(NotesOf(ReportOf("released")), "");
}

TEST(SessionTextTest, OneThatIsNotInTheMapIsNamed) {
  for (const char* const state : {"staged", "quarantined", "retracted", "purged"}) {
    EXPECT_EQ(NotesOf(ReportOf(state)),
              std::string("note: session car/monday is ") + state + ", not in the map\n");
  }
}

TEST(SessionTextTest, JsonHasThemAll) {
  LastingUploadReport report = ReportOf("quarantined", 2);
  report.sessions[0].summary.reason = "a leap";
  EXPECT_EQ(JsonText(SessionStatesJson(report)),
            R"([{"vehicle":"car","session":"monday","state":"quarantined","reason":"a leap",)"
            R"("in_map":false,"others":2}])");
  EXPECT_EQ(JsonText(SessionStatesJson(ReportOf("released"))),
            R"([{"vehicle":"car","session":"monday","state":"released","reason":"",)"
            R"("in_map":true,"others":0}])");
  EXPECT_EQ(JsonText(SessionStatesJson({})), "[]");
}

TEST(SessionTextTest, WhatNobodyCouldBeAskedIsNull) {
  LastingUploadReport report;
  report.sessions_unknown = {StatusCode::kUnavailable, "the link is gone"};
  EXPECT_EQ(JsonText(SessionStatesJson(report)), "null");
  EXPECT_NE(NotesOf(report).find("the link is gone"), std::string::npos);
}

}  // namespace
}  // namespace atlas
