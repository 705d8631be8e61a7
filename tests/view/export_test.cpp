// Files that a session writes.
#include "tools/apps/view/export.h"

#include <sys/stat.h>

#include <cstdlib>

#include "tests/view/session_fixture.h"
#include "tools/sequence/image/contact_sheet.h"
#include "tools/sequence/image/png.h"

namespace postchain::view {
namespace {

namespace fs = std::filesystem;
using test::write_text;

class ExportTest : public SessionTest {
  protected:
    ExportJob job_of(ExportKind kind, const std::string& name) {
        ExportJob job;
        job.kind = kind;
        job.path = path(name);
        job.frames = session_->playback().frames();
        for (const int frame : job.frames)
            job.chains[frame] = std::make_shared<const Chain>(session_->document().chain_at(frame));
        job.run = session_->settings().run;
        job.context.device = egl::ContextOptions::kSoftware;
        return job;
    }
    Status write(const ExportJob& job) {
        return run_export(job, stop_, [&](int done) { done_ = done; });
    }
    // With a script in the place of ffmpeg.
    Status write_movie(const ExportJob& job, const std::string& script) {
        const std::string path_before = std::getenv("PATH");
        fs::create_directories(path("bin"));
        write_text(path("bin/ffmpeg"), "#!/bin/sh\n" + script);
        chmod(path("bin/ffmpeg").c_str(), 0755);
        setenv("PATH", (path("bin") + ":" + path_before).c_str(), 1);
        const Status status = write(job);
        setenv("PATH", path_before.c_str(), 1);
        return status;
    }
    std::atomic<bool> stop_ = false;
    int done_ = 0;
};

TEST_F(ExportTest, FramesAreThoseOfRun) {
    open();
    settle();
    fs::create_directory(path("out"));
    const ExportJob job = job_of(ExportKind::frames, "out/o.####.exr");
    ASSERT_TRUE(write(job).ok());
    EXPECT_EQ(done_, 3);
    EXPECT_EQ(test::read_color(path("out/o.0002.exr")).data, as_run(2).data);
    EXPECT_EQ(write(job).code(), StatusCode::output) << "not without replace";
    fs::remove(path("out/o.0001.exr"));
    EXPECT_EQ(write(job).code(), StatusCode::output);
    EXPECT_FALSE(fs::exists(path("out/o.0001.exr"))) << "nothing is written";
    EXPECT_EQ(write(job_of(ExportKind::frames, "in.####.exr")).code(), StatusCode::usage);
}

TEST_F(ExportTest, MessagesNameWhatTheWindowHas) {
    open();
    settle();
    fs::create_directory(path("out"));
    write_text(path("out/o.0001.exr"), "");
    write_text(path("out/o.png"), "");
    write_text(path("other.yaml"), "");
    std::string said;
    for (const Status& status : {write(job_of(ExportKind::frames, "out/o.####.exr")),
                                 write(job_of(ExportKind::png, "out/o.png")),
                                 write(job_of(ExportKind::frames, "in.####.exr")),
                                 session_->open_chain().save(path("other.yaml"), false)}) {
        session_->messages().clear();
        session_->messages().say(status.message(), true);
        ASSERT_EQ(session_->messages().list().size(), 1u);
        said += session_->messages().list()[0].text + "\n";
        EXPECT_THAT(session_->messages().list()[0].text,
                    testing::Not(testing::ContainsRegex("[ (]--")));
    }
    for (size_t at; (at = said.find(path(""))) != said.npos;)
        said.replace(at, path("").size(), "FOLDER/");
    test::expect_text_of(POSTCHAIN_SOURCE_DIR "/tests/view/expected/export", said);
}

TEST_F(ExportTest, ImagesAndSheet) {
    open();
    settle();
    for (const auto& [kind, name] :
         {std::pair(ExportKind::png, "shown.png"), std::pair(ExportKind::sheet, "sheet.png")}) {
        ExportJob job = job_of(kind, name);
        ASSERT_TRUE(write(job).ok());
        EXPECT_TRUE(test::read_text(path(name)).starts_with("\x89PNG")) << name;
        write_text(path(name), "mine");
        EXPECT_EQ(write(job).code(), StatusCode::output);
        EXPECT_TRUE(test::read_text(path(name)) == "mine") << name;
        job.replace = true;
        EXPECT_TRUE(write(job).ok());
        EXPECT_TRUE(test::read_text(path(name)).starts_with("\x89PNG")) << name;
    }
    stop_ = true;
    for (const auto& [kind, name] : {std::pair(ExportKind::sheet, "other.png"),
                                     {ExportKind::movie, "other.mp4"},
                                     {ExportKind::frames, "other.####.exr"}})
        EXPECT_EQ(write(job_of(kind, name)).code(), StatusCode::canceled) << name;
    for (const auto& entry : fs::directory_iterator(path("")))
        EXPECT_FALSE(entry.path().filename().string().starts_with("other")) << entry.path();
    stop_ = false;
    ExportJob none = job_of(ExportKind::sheet, "other.png");
    none.frames.clear();
    EXPECT_EQ(write(none).code(), StatusCode::usage);
}

TEST_F(ExportTest, InTheBackgroundOneAtATime) {
    open();
    settle();
    fs::create_directory(path("out"));
    std::atomic<int> wakes = 0;
    Exporter exporter([&] { ++wakes; });
    const auto ended = [&] {
        EXPECT_TRUE(wait_for([&] { return !exporter.state().running; }));
        return exporter.state();
    };
    EXPECT_TRUE(exporter.start(job_of(ExportKind::frames, "out/o.####.exr")));
    EXPECT_FALSE(exporter.start(job_of(ExportKind::png, "out/o.png")));
    const ExportState first = ended();
    EXPECT_FALSE(first.failed) << first.text;
    EXPECT_EQ(first.done, 3);
    EXPECT_EQ(first.total, 3);
    EXPECT_EQ(first.text, path("out/o.####.exr: written"));
    EXPECT_EQ(wakes, 3 + 1);
    EXPECT_EQ(test::read_color(path("out/o.0002.exr")).data, as_run(2).data);
    EXPECT_TRUE(exporter.start(job_of(ExportKind::frames, "out/o.####.exr")));
    const ExportState second = ended();
    EXPECT_TRUE(second.failed);
    EXPECT_EQ(second.done, 0);
    EXPECT_THAT(second.text, testing::HasSubstr("out/o.0001.exr"));
    {
        Exporter closed([] {});
        EXPECT_TRUE(closed.start(job_of(ExportKind::sheet, "out/sheet.png")));
    }
    EXPECT_FALSE(fs::exists(path("out/sheet.png")));
    EXPECT_TRUE(exporter.start(job_of(ExportKind::png, "out/o.png"))) << "after a failure";
    EXPECT_FALSE(ended().failed);
    EXPECT_TRUE(fs::exists(path("out/o.png")));
}

// Frames as they are shown, each by its chain, in the order of the job.
TEST_F(ExportTest, ImagesAreThoseOnScreen) {
    open();
    settle();
    std::map<int, Image<uint8_t>> shown;
    const auto job_of = [&](ExportKind kind, const std::string& name) {
        ExportJob job = ExportTest::job_of(kind, name);
        job.frames = {3, 1};
        job.display.exposure_stops = 1;
        job.fps = 12.5;
        return job;
    };
    EXPECT_TRUE(document().set_focus_key(1, 2).ok());
    EXPECT_TRUE(document().set_focus_key(3, 6).ok());
    const io::PreviewOptions display = job_of(ExportKind::png, "").display;
    for (const int frame : {1, 3}) shown[frame] = *io::shown_image(as_run(frame), display);
    ASSERT_TRUE(write(job_of(ExportKind::png, "one.png")).ok());
    EXPECT_TRUE(test::read_text(path("one.png")) == *io::encode_png(shown[3]));
    ASSERT_TRUE(write(job_of(ExportKind::sheet, "sheet.png")).ok());
    io::ContactSheet sheet({.cells = 2, .columns = 2, .width = 64, .height = 48});
    for (const int cell : {0, 1}) {
        sheet.put(cell, 0, shown[cell ? 1 : 3]);
        sheet.label(cell, cell ? "1" : "3");
    }
    sheet.footer("2 of 2 frames");
    EXPECT_TRUE(test::read_text(path("sheet.png")) == *io::encode_png(sheet.picture()));
    EXPECT_EQ(done_, 2);
    ASSERT_TRUE(write_movie(job_of(ExportKind::movie, "all.mp4"), "cat\n").ok());
    std::string frames;
    for (const int frame : {3, 1})
        frames.append(shown[frame].data.begin(), shown[frame].data.end());
    EXPECT_TRUE(test::read_text(path("all.mp4")) == frames);
    ASSERT_TRUE(
        write_movie(job_of(ExportKind::movie, "words.mp4"), "echo \"$@\"\ncat >/dev/null\n").ok());
    EXPECT_THAT(test::read_text(path("words.mp4")),
                testing::HasSubstr("-pixel_format rgb24 -video_size 64x48 -framerate 12.5 "));
}

// A sheet says so in the frame's place; a movie has one size.
TEST_F(ExportTest, AFrameOfAnotherSize) {
    test::write_sequence(folder_.path(), {4}, 48, 64);
    open();
    settle();
    ASSERT_EQ(session_->playback().frames().size(), 4u);
    EXPECT_TRUE(write(job_of(ExportKind::sheet, "sheet.png")).ok());
    EXPECT_EQ(done_, 4);
    const Status movie = write_movie(job_of(ExportKind::movie, "movie.mp4"), "cat\n");
    EXPECT_THAT(movie.message(), testing::HasSubstr("a frame of 48x64 pixels in a movie of 64x48"));
    EXPECT_FALSE(fs::exists(path("movie.mp4")));
}

// A command in the place of ffmpeg, which writes its words and the number of bytes that it got.
TEST_F(ExportTest, AMovieIsWrittenByFfmpeg) {
    open();
    settle();
    const std::string path_before = std::getenv("PATH");
    fs::create_directory(path("bin"));
    setenv("PATH", path("bin").c_str(), 1);
    const Status missing = write(job_of(ExportKind::movie, "movie.mp4"));
    setenv("PATH", path_before.c_str(), 1);
    EXPECT_EQ(missing.code(), StatusCode::output);
    EXPECT_THAT(missing.message(), testing::HasSubstr("install ffmpeg"));
    EXPECT_FALSE(fs::exists(path("movie.mp4")));

    const Status written =
        write_movie(job_of(ExportKind::movie, "movie.mp4"), "echo \"$@\"\nwc -c\n");
    const Status failed =
        write_movie(job_of(ExportKind::movie, "other.mp4"), "cat >/dev/null\nexit 1\n");
    ASSERT_TRUE(written.ok()) << written.message();
    const std::string text = test::read_text(path("movie.mp4"));
    EXPECT_NE(text.find("-video_size 64x48 -framerate 24"), std::string::npos) << text;
    EXPECT_NE(text.find(std::to_string(3 * 3 * 64 * 48)), std::string::npos) << text;
    EXPECT_EQ(failed.code(), StatusCode::output);
    EXPECT_FALSE(fs::exists(path("other.mp4")));
}

}  // namespace
}  // namespace postchain::view
