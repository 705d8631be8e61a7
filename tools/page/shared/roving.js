// Lists with one place in the order of Tab: arrows, Home and End move inside.

/** items(): the elements in their order. horizontal: left and right instead of up and down. */
export function rove(box, items, { horizontal = false, chosen = () => undefined } = {}) {
    const next = horizontal ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
    box.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const list = items();
        const at = list.indexOf(event.target);
        const to = { [next[0]]: at - 1, [next[1]]: at + 1, Home: 0, End: list.length - 1 }[event.key];
        if (at < 0 || to === undefined) return;
        event.preventDefault();
        event.stopPropagation();
        list[Math.min(Math.max(to, 0), list.length - 1)]?.focus();
    });
    box.addEventListener("focusin", (event) => mark(event.target));
    function mark(one) {
        const list = items();
        if (!list.includes(one)) one = chosen() ?? list[0];
        for (const item of list) item.tabIndex = item === one ? 0 : -1;
    }
    return () => mark(items().find((one) => one === document.activeElement));
}
