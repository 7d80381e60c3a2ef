// What is sent, and when, over connections that break at the worst moment.
#include "client/drive/lasting_upload.h"

#include <algorithm>
#include <future>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/client/drive/scripted_daemon.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint8_t kOurs = 1;
constexpr std::uint8_t kAnothers = 2;

KeyframeKey Key(int session, std::uint32_t sequence) {
  return {{"car", "s" + std::to_string(100 + session)}, sequence};
}

std::vector<PlannedKeyframe> Planned(int sessions, std::uint32_t keyframes) {
  std::vector<PlannedKeyframe> planned;
  for (int session = 0; session < sessions; ++session) {
    for (std::uint32_t i = 0; i < keyframes; ++i) {
      planned.push_back({Key(session, i), i});
    }
  }
  return planned;
}

class LastingUploadTest : public ::testing::Test {
 protected:
  struct Outcome {
    Status status;
    LastingUploadReport report;
  };

  // A minute of the daemon's clock.
  static UploadOptions OptionsFor(const ScriptedDaemon& daemon) {
    UploadOptions options;
    options.patience = seconds(60);
    options.now = [&daemon] {
      return daemon.now();
    };
    return options;
  }
  static Status SendOne(const PlannedKeyframe& planned, KeyframeUploader& uploader) {
    const Bytes blob(100, kOurs);
    KeyframeUpload upload;
    upload.key = planned.key;
    upload.time_ms = planned.time_ms;
    upload.blob = blob;
    return uploader.Upload(upload);
  }
  static Outcome Run(ScriptedDaemon& daemon, const std::vector<PlannedKeyframe>& planned) {
    AtlasLink link = daemon.Link();
    LastingUpload upload(planned, OptionsFor(daemon),
                         [&planned](std::size_t i, KeyframeUploader& uploader) {
                           return SendOne(planned[i], uploader);
                         },
                         {});
    Outcome outcome;
    outcome.status = upload.Run(link);
    outcome.report = upload.report();
    return outcome;
  }
  // How many are not answered when keyframe `next` is to be sent, where the daemon answers nothing
  // behind the first one until then, or until that did not come for so long.
  static std::size_t OnTheirWayAt(ScriptedDaemon& daemon, std::size_t next, milliseconds held_for) {
    const auto planned = Planned(1, 20);
    AtlasLink link = daemon.Link();
    std::size_t on_their_way = SIZE_MAX;
    std::promise<void> comes;
    std::future<void> release;
    const auto send = [&](std::size_t i, KeyframeUploader& uploader) {
      if (i == (next == 1 ? 0U : 1U)) {
        daemon.HoldAnswers();
        release = std::async(std::launch::async, [&] {
          comes.get_future().wait_for(held_for);
          daemon.ReleaseAnswers();
        });
      }
      if (i == next) {
        on_their_way = uploader.in_flight();
        comes.set_value();
      }
      return SendOne(planned[i], uploader);
    };
    LastingUpload upload(planned, OptionsFor(daemon), send, {});
    const Status status = upload.Run(link);
    EXPECT_TRUE(status.ok()) << status.message();
    return on_their_way;
  }
  static std::size_t TimesSent(const ScriptedDaemon& daemon, const KeyframeKey& key) {
    const auto came = daemon.came();
    return static_cast<std::size_t>(std::count(came.begin(), came.end(), key));
  }
};

TEST_F(LastingUploadTest, TheFirstOfASessionIsAnsweredBeforeItsSecondIsSent) {
  ScriptedDaemon daemon;
  EXPECT_EQ(OnTheirWayAt(daemon, 1, milliseconds(200)), 0U);
}

TEST_F(LastingUploadTest, TheFirstOnesAreAnsweredBeforeAnythingFollows) {
  ScriptedDaemon daemon;
  EXPECT_EQ(OnTheirWayAt(daemon, kSentTwice, milliseconds(200)), 0U);
}

TEST_F(LastingUploadTest, TheLastOnesThatAreThereAreAnsweredBeforeANewOneIsSent) {
  ScriptedDaemon daemon;
  for (std::uint32_t i = 0; i < 3; ++i) {
    daemon.Store(Key(0, i), kOurs);
  }
  EXPECT_EQ(OnTheirWayAt(daemon, 3, milliseconds(200)), 0U);
}

TEST_F(LastingUploadTest, BetweenThoseNothingIsWaitedFor) {
  ScriptedDaemon daemon;
  EXPECT_EQ(OnTheirWayAt(daemon, 7, seconds(20)), 6U);
}

// Where sending fails nothing more is heard: an answer that is there would be lost with the link.
TEST_F(LastingUploadTest, WhatWasAnsweredIsHeardBeforeMoreIsSent) {
  ScriptedDaemon daemon;
  const auto planned = Planned(1, 20);
  AtlasLink link = daemon.Link();
  LastingUpload upload(planned, OptionsFor(daemon),
                       [&](std::size_t i, KeyframeUploader& uploader) {
                         EXPECT_EQ(uploader.in_flight(), 0U) << i;
                         Status status = SendOne(planned[i], uploader);
                         daemon.AwaitAnswers(i + 1);
                         return status;
                       },
                       {});
  EXPECT_TRUE(upload.Run(link).ok());
}

// What was acknowledged before is lost: behind it there would be a hole.
TEST_F(LastingUploadTest, AnAtlasThatIsRestoredMeanwhileGetsAllOfIt) {
  ScriptedDaemon daemon({{.answers = 30}, {.epoch = 2, .restored = 25}, {.epoch = 2}});
  const auto planned = Planned(1, 40);
  for (std::size_t i = 0; i < 12; ++i) {
    daemon.Store(planned[i].key, kOurs);
  }
  const Outcome outcome = Run(daemon, planned);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.message();
  EXPECT_EQ(outcome.report.reconnections, 1U);
  EXPECT_EQ(daemon.stored().size(), planned.size());
  EXPECT_EQ(outcome.report.sent_before, 12 - kSentTwice) << "by the earlier run, not by this one";
}

TEST_F(LastingUploadTest, WhatWasComparedBeforeARestoreIsComparedAgain) {
  ScriptedDaemon daemon({{.answers = 2}, {.epoch = 2}});
  const auto planned = Planned(3, 10);
  for (std::size_t i = 0; i < 20; ++i) {
    daemon.Store(planned[i].key, kOurs);
  }
  AtlasLink link = daemon.Link();
  bool is_changed = false;
  LastingUpload upload(planned, OptionsFor(daemon),
                       [&](std::size_t i, KeyframeUploader& uploader) {
                         // On the second connection: the first one was compared on the other.
                         if (!daemon.pauses().empty() && !is_changed) {
                           daemon.Store(Key(0, 9), kAnothers);
                           is_changed = true;
                         }
                         return SendOne(planned[i], uploader);
                       },
                       {});
  EXPECT_EQ(upload.Run(link).code(), StatusCode::kConflict);
  EXPECT_TRUE(is_changed);
  EXPECT_EQ(daemon.stored().size(), 20U) << "nothing was added to another drive";
}

// The last keyframes of fifteen sessions, three on each connection.
TEST_F(LastingUploadTest, ManySessionsAreComparedOverAsManyConnectionsAsItTakes) {
  std::vector<ScriptedConnection> connections(60, {.answers = 4, .passes = seconds(10)});
  connections.push_back({.is_made = false});
  ScriptedDaemon daemon(connections);
  const auto planned = Planned(30, 2);
  for (std::size_t i = 0; i < 30; ++i) {
    daemon.Store(planned[i].key, kOurs);
  }
  const Outcome outcome = Run(daemon, planned);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.message();
  EXPECT_EQ(outcome.report.sent_before, 30 - kSentTwice);
  EXPECT_EQ(daemon.stored().size(), planned.size());
  EXPECT_EQ(TimesSent(daemon, Key(0, 1)), 1U) << "what was compared is not sent again";
  for (const milliseconds pause : daemon.pauses()) {
    EXPECT_LE(pause, milliseconds(500)) << "each connection carried something";
  }
}

TEST_F(LastingUploadTest, ThePatienceBeginsAnewWithEachAcknowledgement) {
  ScriptedDaemon daemon({{.answers = 3, .passes = seconds(40)}, {}});
  const Outcome outcome = Run(daemon, Planned(1, 4));
  EXPECT_TRUE(outcome.status.ok()) << outcome.status.message();
  EXPECT_EQ(outcome.report.reconnections, 1U);
}

TEST_F(LastingUploadTest, ThePatienceEnds) {
  ScriptedDaemon daemon({{.answers = 3, .passes = seconds(40)}, {.is_made = false}});
  const auto began = daemon.now();
  const Outcome outcome = Run(daemon, Planned(1, 4));
  EXPECT_EQ(outcome.status.code(), StatusCode::kUnavailable);
  EXPECT_NE(outcome.status.message().find("keyframe car/s100/2"), std::string::npos)
      << outcome.status.message();
  EXPECT_NE(outcome.status.message().find("the last acknowledgement"), std::string::npos);
  EXPECT_LE(daemon.now() - began, seconds(120 + 60));
}

TEST_F(LastingUploadTest, AConnectionThatCarriedSomethingIsFollowedByAFirstAttempt) {
  ScriptedDaemon daemon(ScriptedConnection{.answers = 2});
  const Outcome outcome = Run(daemon, Planned(1, 6));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.message();
  EXPECT_GE(daemon.pauses().size(), 3U);
  for (const milliseconds pause : daemon.pauses()) {
    EXPECT_LE(pause, milliseconds(500));
  }
}

TEST_F(LastingUploadTest, WhatIsOnItsWayAtARefusalIsWaitedForAndCounted) {
  ScriptedDaemon daemon;
  const auto planned = Planned(1, 40);
  daemon.Refuse(Key(0, 11), {StatusCode::kInvalidData, "no keyframe"});
  AtlasLink link = daemon.Link();
  UploadOptions options = OptionsFor(daemon);
  options.max_in_flight = 4;
  LastingUpload upload(planned, options,
                       [&](std::size_t i, KeyframeUploader& uploader) {
                         if (i == 8) daemon.HoldAnswers();  // those of 8, 9 and 10
                         Status status = SendOne(planned[i], uploader);
                         if (!status.ok()) daemon.ReleaseAnswers();
                         return status;
                       },
                       {});
  const Status status = upload.Run(link);
  EXPECT_EQ(status.code(), StatusCode::kInvalidData);
  EXPECT_EQ(upload.report().totals.acked, daemon.stored().size());
  EXPECT_EQ(daemon.stored().size(), 11U);
  EXPECT_NE(status.message().find("before it 11 keyframes"), std::string::npos) << status.message();
}

TEST_F(LastingUploadTest, ALinkThatIsLostForGoodAtTheLastQuestionIsNoFailure) {
  ScriptedDaemon daemon({{.answers = 1 + 5}, {.is_made = false}});
  const Outcome outcome = Run(daemon, Planned(1, 5));
  EXPECT_TRUE(outcome.status.ok()) << outcome.status.message();
  EXPECT_EQ(outcome.report.totals.acked, 5U);
  EXPECT_EQ(outcome.report.sessions_unknown.code(), StatusCode::kUnavailable);
  EXPECT_TRUE(outcome.report.sessions.empty());
}

TEST_F(LastingUploadTest, NorIsADaemonThatWantsToBeLeftAloneThen) {
  ScriptedDaemon daemon(ScriptedConnection{.questions = 1});
  const Outcome outcome = Run(daemon, Planned(1, 5));
  EXPECT_TRUE(outcome.status.ok()) << outcome.status.message();
  EXPECT_EQ(outcome.report.sessions_unknown.code(), StatusCode::kUnavailable);
}

TEST_F(LastingUploadTest, AtTheFirstQuestionItIsOne) {
  ScriptedDaemon daemon(ScriptedConnection{.questions = 0});
  EXPECT_EQ(Run(daemon, Planned(1, 5)).status.code(), StatusCode::kUnavailable);
}

}  // namespace
}  // namespace atlas
