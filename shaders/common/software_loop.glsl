// SOFTWARE_LOOP marks a loop that tests at its end for the sake of software renderers. Their lanes run
// in step and skip nothing, so a loop that tests at its start runs its body once more to find the test.
// The body runs at least once: before a loop that may be empty stands an `if`.
#ifndef SOFTWARE_LOOP
#define SOFTWARE_LOOP
#endif
