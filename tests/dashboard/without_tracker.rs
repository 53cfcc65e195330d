//! The page of a worm that nobody sees.

use super::http::Browser;
use super::watched::start;
use super::worm::Worm;

#[test]
fn its_cells_are_dashed_where_the_motors_current_has_them_and_its_tips_are_not_known() {
    let Some(browser) = Browser::start(1280, 900) else {
        return;
    };
    let worm = Worm::on_a_steady_computer("d-blind");
    let config = worm.config("[gait]\ncycle_s = 1.25\n[tracker]\npresent = false\n");
    let _up = worm.wormd(&["up", "--plain", "--config", &config]).start_silent();
    let arguments = ["dashboard", "--listen", "127.0.0.1:0", "--config", &config];
    let (_dashboard, address) = start(worm.wormd(&arguments).into_command());
    browser.open(&format!("http://{address}/"));
    browser.wait_for("document.querySelectorAll('#cells tbody tr').length === 4");
    browser.wait_for("document.querySelectorAll('#worm .cell.inferred').length === 4");
    let position = "Number(document.querySelector('#worm .cell').dataset.positionMm)";
    let before = browser.run(&format!("return {position}")).as_f64().expect("a number");
    browser.wait_for(&format!("{position} > {before} + 2"));
    browser.wait_for(
        "/inferred from the motor's current, ± \\d+ mm/.test(document.getElementById('canal-text').textContent)",
    );
    let tips = "return [...document.querySelectorAll('#cells .tip')].map((tip) => tip.textContent).join()";
    assert_eq!(browser.run(tips), "–,–,–,–", "nothing says that they stick");
    let charts = "return [...document.querySelectorAll('#charts .u-title')].filter((it) => it.checkVisibility()).map((it) => it.textContent).join()";
    assert_eq!(
        browser.run(charts),
        "motor current, mA",
        "what nobody measures has no empty chart"
    );
}
