// A restore tells where what was there is, and names no file that is not.
#include "client/cli/commands/atlas/restore_text.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace atlas {
namespace {

std::string TextOf(const RestoreSummary& done, bool is_json = false) {
  std::ostringstream out;
  PrintRestore(done, {out, out, is_json, false, false, {}, {}});
  return out.str();
}

bool Says(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

TEST(RestoreTextTest, OfADatabaseThatWasThereItsName) {
  RestoreSummary done;
  done.kept = "/data/atlas.db.replaced-1";
  EXPECT_TRUE(Says(TextOf(done), "what was there is /data/atlas.db.replaced-1\n"));
  EXPECT_TRUE(Says(TextOf(done, true), R"("kept":"/data/atlas.db.replaced-1")"));
}

TEST(RestoreTextTest, OfNoneThoseOfWhatWasLeft) {
  RestoreSummary done;
  done.left = {"/data/atlas.db.replaced-2-wal", "/data/atlas.db.replaced-2-revision"};
  const std::string text = TextOf(done);
  EXPECT_TRUE(Says(text, "is /data/atlas.db.replaced-2-wal and /data/atlas.db.replaced-2-revision"))
      << text;
  EXPECT_TRUE(Says(text, "acknowledged")) << text;
  EXPECT_FALSE(Says(text, "what was there is")) << text;
  EXPECT_TRUE(Says(TextOf(done, true), R"("kept":"/data/atlas.db.replaced-2-wal")"));
}

TEST(RestoreTextTest, ANoteHasNoWrites) {
  RestoreSummary done;
  done.left = {"/data/atlas.db.replaced-2-revision"};
  EXPECT_TRUE(Says(TextOf(done), "is /data/atlas.db.replaced-2-revision\n")) << TextOf(done);
}

TEST(RestoreTextTest, OfNothingNothing) {
  EXPECT_FALSE(Says(TextOf({}), "there")) << TextOf({});
  EXPECT_TRUE(Says(TextOf({}, true), R"("kept":"")"));
}

}  // namespace
}  // namespace atlas
