// The keys of a report, besides those of every viewer.
export const kKeys = [
    [["1", "9"], "a variant, by its place in the list"],
    [["0"], "the truth"],
    [["I"], "the input"],
    [["N", "B"], "next picture, the one before"],
    [["Shift", "Drag"], "choose a region for the crops"],
];

export function actions_of(page) {
    const actions = {
        0: () => page.show("truth"), i: () => page.show("input"),
        n: () => page.step(1), b: () => page.step(-1),
    };
    for (let digit = 1; digit <= 9; ++digit) actions[digit] = () => page.show(String(digit));
    return actions;
}
