#include "tools/service/work/service_state.h"

#include "tools/service/work/preview.h"

namespace postchain::service {

Job Service::State::shown(Job job, const QueuePlaces& places) const {
    job.remaining_s = backend->remaining_s(job.id);
    const auto place = places.find(job.id);
    if (place != places.end()) job.place = place->second;
    return job;
}

Job Service::State::shown(Job job) const {
    if (job.state != JobState::queued) return shown(std::move(job), {});
    const auto places = store->places();
    return shown(std::move(job), places.ok() ? *places : QueuePlaces());
}

void Service::State::hear(const Event& event) {
    log->enter(event);
    const std::lock_guard lock(listener_mutex);
    if (listener) listener(event);
}

Job Service::State::known(const std::string& id) const {
    auto job = stored(store->job(id));
    if (!job) throw Problem{Problem::Kind::not_found, "no job '" + id.substr(0, 40) + "'"};
    return shown(std::move(*job));
}

JobFrame Service::State::known(const std::string& id, int frame) const {
    known(id);
    auto found = stored(store->frame(id, frame));
    if (!found)
        throw Problem{Problem::Kind::not_found, concat("job ", id, " has no frame ", frame)};
    return std::move(*found);
}

JobReader Service::State::reader_of(const User& user) const {
    auto own = readers.of(user);
    if (!own.ok()) throw Problem{Problem::Kind::forbidden, own.status().message()};
    return std::move(*own);
}

void Service::State::show(const User& user, const ImageWanted& wanted,
                          const std::function<void(Answer<Picture>)>& done, const FindFrame& find) {
    const auto image = [wanted, reader = reader_of(user), find] {
        try {
            const ShownFrame shown = taken(find(reader));
            auto bytes = image_of(shown.path, shown.frame, shown.source, wanted);
            if (!bytes.ok()) throw problem_of(bytes.status(), reader.roots());
            return Picture{wanted.type, std::move(*bytes)};
        } catch (const Problem&) {
            throw;
        } catch (...) {
            throw problem_of(status_of_exception("the image"), reader.roots());
        }
    };
    if (!thumbnails.run([done, image] { done(answer(image)); }))
        throw Problem{Problem::Kind::busy, "too many images are waiting; try again", {}, 1};
}

Job Service::State::change(const User& user, const std::string& id, const std::string& why_not,
                           const std::function<bool(const Job&)>& work) {
    Job job = known(id);
    if (!user.admin && job.owner != user.name)
        throw Problem{Problem::Kind::forbidden,
                      concat("job ", id, " is of ", job.owner.empty() ? "another user" : job.owner,
                             "; only its owner and administrators may change it")};
    if (!work(job))
        throw Problem{Problem::Kind::conflict,
                      concat("job ", id, " is ", name_of(job.state), why_not)};
    // A job that was just removed is returned as it was.
    return shown(stored(store->job(id)).value_or(std::move(job)));
}

}  // namespace postchain::service
